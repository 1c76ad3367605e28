/** A number that can be changed: its name, a slider, a field, its unit, and what is said of it below. */
import { made, typed } from "./made.js";
import { digits, displayed, quantity } from "./units.js";

export class SliderRow {
  /**
   * @param {string} name @param {string} unit @param {number[]} range low, value, high @param {(value: number) => void} change
   * @param {{begin?: () => void, title?: string, about?: string}} [more] what is done before a change, tooltips of slider and field
   */
  constructor(name, unit, [low, value, high], change, { begin = () => {}, title, about } = {}) {
    const [factor, shown] = displayed(unit);
    Object.assign(this, { factor, unit });
    this.range = made("input", { type: "range", min: low, max: high, step: "any", value, "aria-label": name, title: title || false, onpointerdown: begin, onkeydown: begin,
      oninput: () => change(Number(this.range.value)) });
    this.field = made("input", { type: "text", inputmode: "decimal", "aria-label": `${name} [${shown}]`, title: about || false, onblur: () => this.show(this.value),
      onchange: () => { begin(); typed(this.field.value, (given) => change(given / factor), (text) => this.say(text)); } });
    this.note = made("span", { class: "note", hidden: true });
    this.row = made("div", { class: "row" }, made("label", {}, name), this.range, this.field, made("span", { class: "unit" }, shown), this.note);
    this.show(value);
  }

  show(value) {
    this.value = value;
    this.range.value = String(value);
    this.range.setAttribute("aria-valuetext", quantity(value, this.unit));
    if (document.activeElement !== this.field) this.field.value = digits(value * this.factor, 7);
  }

  /** A sentence below; "" none. */
  say(text) {
    this.note.hidden = !text;
    this.note.textContent = text;
  }
}
