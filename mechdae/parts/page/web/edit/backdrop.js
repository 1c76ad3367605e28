/** What lies behind a drawing: a grid with lengths, and a photo with its scale. */
import { element } from "../view.js";
import { displayed } from "../units.js";

const LINES_APART = 46;

/** Steps of 1, 2 or 5 times a power of ten. */
export const roundStep = (rough) => { const power = 10 ** Math.floor(Math.log10(rough)); return power * ([1, 2, 5].find((k) => k * power >= rough * (1 - 1e-9)) ?? 10); };

export class Backdrop {
  /** @param {any} diagram */
  constructor(diagram) {
    this.diagram = diagram;
    this.layer = element("g", { class: "backdrop" });
    diagram.svg.prepend(this.layer);
    this.image = element("image", { preserveAspectRatio: "none", opacity: 0.5 }, this.layer);
    this.lines = element("g", {}, this.layer);
    /** Metres: lower left corner, width, height. */
    this.photo = null;
    this.step = 0.005;
  }

  draw(grid) {
    const { diagram } = this, { size } = diagram, [factor, unit] = displayed("m");
    const wide = roundStep((LINES_APART / diagram.scale) * factor) / factor;
    this.step = wide / ([2, 20, 200].includes(Number((wide * factor).toPrecision(1))) ? 4 : 5);
    this.lines.replaceChildren();
    if (grid) {
      const [left, top] = diagram.from([0, 0]), [right, low] = diagram.from(size);
      const at = (from, to) => Array.from({ length: Math.max(0, Math.floor(to / wide) - Math.ceil(from / wide) + 1) }, (_, k) => (Math.ceil(from / wide) + k) * wide);
      const shown = (value) => String(Number((value * factor).toPrecision(6)));
      for (const x of at(left, right)) {
        const [u] = diagram.at([x, 0]);
        element("path", { d: `M${u.toFixed(2)} 0V${size[1]}`, class: Math.abs(x) < wide / 2 ? "axis" : "grid" }, this.lines);
        if (u > 40 && u < size[0] - 8 * shown(x).length) element("text", { x: u + 2, y: 9, class: "tick" }, this.lines).textContent = shown(x);
      }
      for (const y of at(low, top)) {
        const [, v] = diagram.at([0, y]);
        element("path", { d: `M0 ${v.toFixed(2)}H${size[0]}`, class: Math.abs(y) < wide / 2 ? "axis" : "grid" }, this.lines);
        if (v > 20 && v < size[1] - 24) element("text", { x: 2, y: v - 2, class: "tick" }, this.lines).textContent = shown(y);
      }
      element("text", { x: 2, y: 9, class: "tick" }, this.lines).textContent = unit;
    }
    this.image.setAttribute("display", this.photo ? "inline" : "none");
    if (!this.photo) return;
    const { place: [x, y], width, height } = this.photo, [u, v] = diagram.at([x, y + height]);
    for (const [name, value] of Object.entries({ x: u, y: v, width: width * diagram.scale, height: height * diagram.scale })) this.image.setAttribute(name, String(value));
  }

  /** Put a picture behind what is seen, as large as that. @param {string} url @param {number} ratio height to width */
  put(url, ratio) {
    const { diagram } = this, [left, top] = diagram.from([0, 0]), [right] = diagram.from(diagram.size), width = 0.8 * (right - left);
    this.image.setAttribute("href", url);
    this.photo = { place: [left + 0.1 * (right - left), top - 0.05 * (right - left) - width * ratio], width, height: width * ratio };
  }

  /** Scale the picture about one place of it so that another one is so far away. */
  scaled([x, y], to, length) {
    const share = length / Math.hypot(to[0] - x, to[1] - y), { place, width, height } = this.photo;
    this.photo = { place: [x + share * (place[0] - x), y + share * (place[1] - y)], width: share * width, height: share * height };
  }
}
