/** Controls of several drivers: which one the curves are drawn over, and a slider for each. */
import { find, made } from "./made.js";
import { SliderRow } from "./slider.js";
import { quantity } from "./units.js";
import { words } from "./words.js";

export class Several {
  /** @param {any} app */
  constructor(app) {
    this.app = app;
    const { data, session } = app;
    const own = made("select", { "aria-label": words("along"), onchange: () => this.choose(Number(own.value)) },
      made("option", { value: -1 }, words(session.way.name)), ...data.drivers.map(({ name }, k) => made("option", { value: k }, name)));
    if (session.way.held) own.firstChild.remove(); // the file's way is that of a driver
    this.select = own;
    const box = made("fieldset", {}, made("legend", {}, words("drivers")), made("label", {}, `${words("along")} `, own));
    const begin = session.drivers();
    this.rows = data.drivers.map(({ name, unit, turns, size }, k) => {
      const reach = turns ? Math.PI : size;
      return new SliderRow(name, unit, [begin[k] - reach, begin[k], begin[k] + reach], (value) => app.want({ driver: [k, value] }), { begin: () => session.remember() });
    });
    box.append(...this.rows.map(({ row }) => row));
    find("dimensions").append(box);
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
    const { session } = this.app;
    const other = session.motion.way.name !== this.app.data.drivers[k].name;
    if (!session.along(k)) return false;
    session.changed();
    const { ends, round } = session.motion;
    const [low, high] = [ends[0] ? ends[0].s : -Infinity, ends[1] ? ends[1].s : Infinity];
    const kept = round ? value : Math.min(Math.max(value, low), high);
    session.drive(kept);
    this.rows[k].say(kept === value ? "" : `${words(value > kept ? "larger" : "smaller")} ${quantity(kept, this.rows[k].unit)}: ${session.opening(value)}`);
    return other;
  }

  /** Show the drivers' values. */
  draw() {
    const { session, data } = this.app;
    const { way } = session.motion;
    this.select.value = String(way.held ? data.drivers.findIndex(({ name }) => name === way.name) : -1);
    session.drivers().forEach((value, k) => this.rows[k].show(value));
  }
}
