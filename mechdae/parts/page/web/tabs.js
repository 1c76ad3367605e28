/** Tabs: one panel is shown; those that are hidden are not drawn. */
import { find, made } from "./made.js";

export class Tabs {
  /** @param {HTMLElement} bar @param {() => void} changed */
  constructor(bar, changed) {
    Object.assign(this, { bar, changed, panels: new Map(), shown: "" });
    bar.addEventListener("keydown", (event) => {
      const way = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!way) return;
      const ids = [...this.panels.keys()];
      this.show(ids[(ids.indexOf(this.shown) + way + ids.length) % ids.length]);
      this.panels.get(this.shown).tab.focus();
      event.stopPropagation();
    });
  }

  /** A panel that is drawn by `drawing` (`whole`, `frame`) in an element that has its id. */
  add(id, title, about, drawing) {
    const tab = made("button", { type: "button", role: "tab", id: `tab-${id}`, "aria-controls": id, title: about, onclick: () => this.show(id) }, title);
    this.bar.append(tab);
    for (const [name, value] of Object.entries({ role: "tabpanel", "aria-labelledby": `tab-${id}`, tabindex: "0" })) find(id).setAttribute(name, value);
    this.panels.set(id, { tab, drawing });
    if (this.shown) this.mark();
    else this.show(id);
  }

  mark() {
    for (const [id, { tab }] of this.panels) {
      tab.setAttribute("aria-selected", String(id === this.shown));
      tab.setAttribute("tabindex", id === this.shown ? "0" : "-1");
      find(id).hidden = id !== this.shown;
    }
  }

  show(id) {
    this.shown = id;
    this.mark();
    this.changed();
  }

  /** What draws the panel that is shown. */
  get drawing() { const own = this.panels.get(this.shown); return own ? own.drawing : null; }
}
