/** Controls of several drivers: which one the curves are drawn over, and a slider for each. */
import { numberIn } from "./made.js";
import { digits, displayed, quantity } from "./units.js";

export class Several {
  /** @param {any} app @param {HTMLElement} into @param {any} made makes an element */
  constructor(app, into, made) {
    this.app = app;
    const { data, session, words } = app;
    const own = made("select", { "aria-label": words("along"), onchange: () => this.choose(Number(own.value)) },
      made("option", { value: -1 }, words(session.way.name)), ...data.drivers.map(({ name }, k) => made("option", { value: k }, name)));
    if (session.way.held) own.firstChild.remove(); // the file's way is that of a driver
    this.select = own;
    const box = made("fieldset", {}, made("legend", {}, words("drivers")), made("label", {}, `${words("along")} `, own));
    const begin = session.drivers();
    this.rows = data.drivers.map(({ name, unit, turns, size }, k) => {
      const [factor, shown] = displayed(unit);
      const reach = turns ? Math.PI : size;
      const range = made("input", { type: "range", min: begin[k] - reach, max: begin[k] + reach, step: "any", value: begin[k], "aria-label": name,
        oninput: () => app.want({ driver: [k, Number(range.value)] }) });
      const field = made("input", { type: "text", inputmode: "decimal", "aria-label": `${name} [${shown}]`,
        onchange: () => app.want({ driver: [k, numberIn(field.value) / factor] }) });
      const note = made("span", { class: "note", hidden: true });
      box.append(made("div", { class: "row" }, made("label", {}, name), range, field, made("span", { class: "unit" }, shown), note));
      return { range, field, note, factor, unit };
    });
    into.append(box);
  }

  /** Draw curves along a driver, or (-1) along the file's way. */
  choose(k) {
    const { session } = this.app;
    session.along(k);
    this.app.drawAll();
    if (session.reason) this.app.say(session.reason, true);
  }

  /** Move one driver with the others held; whether it changed what the curves are drawn over. */
  drive(k, value) {
    const { session, words } = this.app;
    const other = session.motion.way.name !== this.app.data.drivers[k].name;
    if (!Number.isFinite(value) || !session.along(k)) return false;
    const { ends, way } = session.motion;
    const [low, high] = [ends[0] ? ends[0].s : -Infinity, ends[1] ? ends[1].s : Infinity];
    const kept = way.turns && !ends[0] && !ends[1] ? value : Math.min(Math.max(value, low), high);
    session.drive(kept);
    const { note, unit } = this.rows[k];
    note.hidden = kept === value;
    note.textContent = kept === value ? "" : `${words(value > kept ? "larger" : "smaller")} ${quantity(kept, unit)}: ${session.opening(value)}`;
    return other;
  }

  /** Show the drivers' values. */
  draw() {
    const { session, data } = this.app;
    const { way } = session.motion;
    this.select.value = String(way.held ? data.drivers.findIndex(({ name }) => name === way.name) : -1);
    session.drivers().forEach((value, k) => {
      const { range, field, factor, unit } = this.rows[k];
      range.value = String(value);
      range.setAttribute("aria-valuetext", quantity(value, unit));
      if (document.activeElement !== field) field.value = digits(value * factor, 7);
    });
  }
}
