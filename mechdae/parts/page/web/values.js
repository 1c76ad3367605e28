/** All values of the pose shown, as a table. */
import { bareAngle } from "./session.js";
import { find, made, rowOf, tableOf } from "./made.js";
import { words } from "./words.js";
import { digits, quantity } from "./units.js";

export class Values {
  /** @param {any} app @param {string} id of the panel */
  constructor(app, id) {
    this.app = app;
    const table = tableOf([words("quantity"), words("value")], []);
    this.body = table.tBodies[0];
    this.box = made("details", { class: "values", ontoggle: () => this.frame(app.session.pose, app.session.forcesAt(app.session.pose)) }, made("summary", {}, words("all_values")), table);
    find(id).append(this.box);
  }

  frame(pose, forces) {
    if (!this.box.open) return;
    const rows = [], { session, data } = this.app;
    const row = (name, text) => rows.push([name, text]);
    if (forces && forces.status !== "jammed") {
      for (const [name, value] of Object.entries(forces.efforts)) row(`${words("effort")} ${name}`, quantity(value, data.forces.units[name]));
      for (const [name, [x, y, moment]] of Object.entries(forces.reactions)) row(`${words("reaction")} ${name}`, `${quantity(Math.hypot(x, y), "N", 5)}; ${quantity(moment, "N m", 5)}`);
    }
    for (const entry of data.entries) {
      if (bareAngle(entry)) continue;
      const { part, names, unit } = entry, [found, speed] = [0, 1].map((order) => session.told(pose, entry, order));
      const shown = (v) => (names[0] === "orientation" ? digits(v, 5) : quantity(v, unit, 5));
      const noise = found && 1e-12 * Math.max(...found.map(Math.abs)); // beside the largest component
      const text = found ? (found.length > 1 ? `(${found.map((v) => shown(Math.abs(v) < noise ? 0 : v)).join("; ")})` : quantity(found[0], unit)) : "–";
      const rate = speed ? quantity(Math.hypot(...speed) * (speed.length === 1 && speed[0] < 0 ? -1 : 1), `${unit}/s`, 5) : "–";
      row(names[0] === "orientation" ? `${part} (${words("quaternion")})` : part, `${text}; ${rate}`);
    }
    // rows that stay are kept: only texts that changed are laid out again
    while (this.body.rows.length > rows.length) this.body.deleteRow(-1);
    rows.forEach((texts, k) => {
      const own = this.body.rows[k] || this.body.appendChild(rowOf("", ""));
      texts.forEach((text, j) => { if (own.cells[j].textContent !== text) own.cells[j].textContent = text; });
    });
  }
}
