/** A curve over the driver with a cursor that drives. */
import { element } from "./view.js";

const EDGE = { left: 62, right: 10, top: 10, bottom: 34 };

/** Round steps of 1, 2 or 5 times a power of ten. */
export function ticks(low, high, count) {
  const rough = (high - low) / count;
  if (!(rough > 0)) return [low];
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].find((k) => k * power >= rough) * power;
  const list = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1) list.push(k * step);
  return list;
}

export class Chart {
  /** @param {SVGSVGElement} svg @param {(s: number) => void} drive */
  constructor(svg, drive) {
    this.svg = svg;
    this.curve = element("g", {}, svg);
    this.cursor = element("line", { class: "cursor" }, svg);
    this.dot = element("circle", { r: 4, class: "velocity" }, svg);
    const move = (event) => {
      const { left, width } = svg.getBoundingClientRect();
      const share = (event.clientX - left - EDGE.left) / (width - EDGE.left - EDGE.right);
      if (this.range) drive(this.range[0] + Math.min(1, Math.max(0, share)) * (this.range[1] - this.range[0]));
    };
    svg.addEventListener("pointerdown", (event) => { svg.setPointerCapture(event.pointerId); move(event); });
    svg.addEventListener("pointermove", (event) => { if (event.buttons) move(event); });
  }

  /** Draw values (null: none) over places; `shown` turns numbers of the axes into text. */
  draw(places, values, shown) {
    this.rect = this.rect || this.svg.getBoundingClientRect();
    const { width, height } = this.rect;
    this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.curve.replaceChildren();
    const known = values.filter((value) => value !== null);
    this.range = [places[0], places[places.length - 1]];
    let low = Math.min(...known), high = Math.max(...known);
    if (!known.length) [low, high] = [0, 1];
    if (high - low < 1e-9 * Math.max(Math.abs(high), Math.abs(low), 1e-9)) [low, high] = [low - 0.5 * (Math.abs(low) || 1), high + 0.5 * (Math.abs(high) || 1)];
    const room = 0.05 * (high - low);
    this.low = low - room; this.high = high + room;
    this.size = [width - EDGE.left - EDGE.right, height - EDGE.top - EDGE.bottom];
    for (const value of shown.values([this.low, this.high])) {
      const y = this.y(value);
      element("line", { x1: EDGE.left, x2: width - EDGE.right, y1: y, y2: y, class: "axis", opacity: 0.35 }, this.curve);
      element("text", { x: EDGE.left - 5, y: y + 3, "text-anchor": "end", class: "tick" }, this.curve).textContent = shown.value(value);
    }
    for (const place of shown.places(this.range)) {
      const x = this.x(place);
      element("text", { x, y: height - 17, "text-anchor": "middle", class: "tick" }, this.curve).textContent = shown.place(place);
    }
    element("text", { x: width - EDGE.right, y: height - 4, "text-anchor": "end", class: "tick" }, this.curve).textContent = shown.name;
    let path = "";
    let pen = "M";
    values.forEach((value, k) => {
      if (value === null) { pen = "M"; return; }
      path += `${pen}${this.x(places[k]).toFixed(1)} ${this.y(value).toFixed(1)}`;
      pen = "L";
    });
    element("path", { d: path, class: "curve" }, this.curve);
    let begin = null;
    values.forEach((value, k) => {
      if (value === null && begin === null) begin = k;
      if ((value !== null || k === values.length - 1) && begin !== null) {
        const from = this.x(places[Math.max(begin - 1, 0)]), to = this.x(places[k]);
        element("rect", { x: from, y: EDGE.top, width: Math.max(to - from, 1), height: this.size[1], class: "missing" }, this.curve);
        begin = null;
      }
    });
  }

  x(place) { return EDGE.left + (this.size[0] * (place - this.range[0])) / (this.range[1] - this.range[0] || 1); }

  y(value) { return EDGE.top + (this.size[1] * (this.high - value)) / (this.high - this.low); }

  mark(place, value) {
    if (!this.size) return;
    const x = this.x(place);
    for (const [name, own] of Object.entries({ x1: x, x2: x, y1: EDGE.top, y2: EDGE.top + this.size[1] })) this.cursor.setAttribute(name, String(own));
    this.dot.setAttribute("visibility", value === null ? "hidden" : "visible");
    if (value !== null) {
      this.dot.setAttribute("cx", String(x));
      this.dot.setAttribute("cy", String(this.y(value)));
    }
  }
}
