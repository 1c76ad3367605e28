/** Curves over the driver with a cursor that drives; their extremes are marked. */
import { element, pathOf } from "./view.js";
import { digits, displayed } from "./units.js";
import { words } from "./words.js";

const EDGE = { left: 54, right: 12, top: 17, bottom: 6 }, FOOT = 15;
/** Extremes nearer than this [px] to another one have no number. */
const CROWDED = 26;
/** What is smaller than this share of the largest value, or of what is natural, is rounding. */
export const SILENCE = 1e-11;
/** A curve jumps where a step is so many times those beside it. */
const JUMP = 2;
/** A curve has a corner where it bends so many times as much as beside it. */
const CORNER = 8;
/** Length of the marks of many events [px]. */
const TICK = 6;

/** Round steps of 1, 2 or 5 times a power of ten; of large angles in degrees parts of a turn. */
export function ticks(low, high, count, turns = false) {
  const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
  if (!(rough > 0)) return [low];
  const part = turns && high - low >= 60 ? [15, 30, 45, 60, 90, 180, 360, 720].find((own) => own >= rough) : 0;
  const step = part || [1, 2, 5, 10].find((k) => k * power >= rough) * power, first = Math.ceil(low / step - 1e-9);
  return Array.from({ length: Math.floor(high / step + 1e-9) - first + 1 }, (_, k) => (first + k) * step);
}

/** The largest and the least value with their places, from parabolas through three neighbours, none across a jump: a step much larger than those beside it. At a corner the value between the poses is not known. */
export function extremes(places, values) {
  const found = [];
  for (const sense of [1, -1]) {
    let best = -1;
    values.forEach((value, k) => { if (value !== null && (best < 0 || sense * value > sense * values[best])) best = k; });
    if (best < 0) return [];
    const [a, b, c] = [values[best - 1], values[best], values[best + 1]], bend = a - 2 * b + c;
    const jumps = (way) => {
      const [before, here, next, after] = [-way, 0, way, 2 * way].map((k) => values[best + k]), near = [here - before, Number.isFinite(after) ? after - next : 0];
      return Math.abs(next - here) > JUMP * Math.max(...near.map(Math.abs));
    };
    const inside = Number.isFinite(bend) && !jumps(1) && !jumps(-1) && a !== null && c !== null && a !== undefined && c !== undefined && sense * bend < 0;
    const t = inside ? (a - c) / (2 * bend) : 0;
    const beside = [-1, 1].map((way) => Math.abs(values[best + 2 * way] - 2 * values[best + way] + b)), corner = inside && bend > CORNER * Math.min(...beside);
    found.push({ corner, place: places[best] + t * ((places[best + 1] ?? places[best]) - places[best]), value: b - (inside ? (t * (a - c)) / 4 : 0), sense });
  }
  const most = Math.max(...found.map(({ value }) => Math.abs(value)));
  for (const own of found) if (Math.abs(own.value) < SILENCE * most) own.value = 0;
  return found[0].value - found[1].value > 1e-9 * Math.max(Math.abs(found[0].value), Math.abs(found[1].value)) ? found : [];
}

export class Chart {
  /** @param {SVGSVGElement} svg @param {(s: number) => void} drive */
  constructor(svg, drive) {
    this.svg = svg;
    this.curve = element("g", {}, svg);
    this.cursor = element("line", { class: "cursor", x1: 0, x2: 0 }, svg);
    this.dots = element("g", {}, svg);
    const move = (event) => {
      const { left, width } = svg.getBoundingClientRect();
      const share = (event.clientX - left - EDGE.left) / (width - EDGE.left - EDGE.right);
      if (this.range) drive(this.range[0] + Math.min(1, Math.max(0, share)) * (this.range[1] - this.range[0]));
    };
    svg.addEventListener("pointerdown", (event) => { svg.setPointerCapture(event.pointerId); move(event); });
    svg.addEventListener("pointermove", (event) => { if (event.buttons) move(event); });
  }

  /**
   * Draw lines of values (null: none) over places; `foot` has the numbers of the places.
   * @param {number[]} places @param {any[]} lines values, look, name @param {{title: string, unit: string, along: string, foot: string, events: any[]}} shown
   */
  draw(places, lines, { title, unit, along, foot, events = [] }) {
    const { width, height } = (this.rect ||= this.svg.getBoundingClientRect()); // looked up once: it makes the browser lay out
    this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.curve.replaceChildren();
    this.range = [places[0], places[places.length - 1]];
    const known = lines.flatMap(({ values }) => values.filter((value) => value !== null));
    let [low, high] = known.reduce(([least, most], value) => [Math.min(least, value), Math.max(most, value)], [Infinity, -Infinity]);
    if (!known.length) [low, high] = [0, 1];
    if (high - low < 1e-9 * Math.max(Math.abs(high), Math.abs(low), 1e-9)) [low, high] = [low - 0.5 * (Math.abs(low) || 1), high + 0.5 * (Math.abs(high) || 1)];
    const room = 0.09 * (high - low);
    [this.low, this.high] = [low - room, high + room];
    this.size = [width - EDGE.left - EDGE.right, height - EDGE.top - EDGE.bottom - FOOT];
    const [factor, name] = displayed(unit), [share, where] = displayed(along);
    const text = (x, y, anchor, kind, value) => { element("text", { x, y, "text-anchor": anchor, class: kind }, this.curve).textContent = value; };
    for (const value of ticks(this.low * factor, this.high * factor, Math.max(2, Math.floor(this.size[1] / 26)), name === "°")) {
      const y = this.y(value / factor);
      element("line", { x1: EDGE.left, x2: width - EDGE.right, y1: y, y2: y, class: "axis" }, this.curve);
      text(EDGE.left - 5, y + 3, "end", "tick", digits(value, 4));
    }
    for (const value of ticks(this.range[0] * share, this.range[1] * share, 8, where === "°")) {
      const x = this.x(value / share);
      element("line", { x1: x, x2: x, y1: EDGE.top, y2: EDGE.top + this.size[1], class: "axis" }, this.curve);
      text(x, height - 8, "middle", "tick", digits(value, 4));
    }
    text(2, 11, "start", "title", `${title}${name ? `, ${name}` : ""}`);
    if (foot) text(width - EDGE.right, 11, "end", "tick", `${foot}${where ? `, ${where}` : ""}`);
    for (const { times, many, about } of events) {
      const ways = times.map((at) => `M${this.x(at).toFixed(1)} ${EDGE.top}v${many ? TICK : this.size[1]}`);
      element("title", {}, element("path", { d: ways.join(""), class: many ? "event many" : "event" }, this.curve)).textContent = about;
    }
    for (const { values, look } of lines) {
      const way = values.map((value, k) => (value === null ? null : [this.x(places[k]), this.y(value)]));
      element("path", { d: pathOf(way), class: `curve ${look}` }, this.curve);
    }
    this.gaps(places, lines);
    const taken = [];
    for (const { values } of lines) {
      for (const { place, value, sense, corner } of extremes(places, values)) {
        const [x, y] = [this.x(place), this.y(value)];
        element("circle", { cx: x, cy: y, r: 2.4, class: "extreme" }, this.curve);
        if (corner && value !== 0) continue; // less than it changes from pose to pose
        if (taken.some(([u, v]) => Math.hypot(u - x, 2 * (v - y)) < 2 * CROWDED)) continue;
        taken.push([x, y]);
        text(Math.min(Math.max(x, EDGE.left + 18), width - EDGE.right - 18), y + (sense > 0 ? -4 : 11), "middle", "extreme", digits(value * factor, 4));
      }
    }
    this.dots.replaceChildren(...lines.map(({ look }) => element("circle", { r: 3.6, class: `at ${look}` })));
    for (const [key, value] of Object.entries({ y1: EDGE.top, y2: EDGE.top + this.size[1] })) this.cursor.setAttribute(key, String(value));
  }

  /** Grey bands where there is no pose. */
  gaps(places, lines) {
    let begin = null;
    places.forEach((place, k) => {
      const none = lines.length > 0 && lines.every(({ values }) => values[k] === null);
      if (none && begin === null) begin = k;
      if ((!none || k === places.length - 1) && begin !== null) {
        const from = this.x(places[Math.max(begin - 1, 0)]);
        const band = element("rect", { x: from, y: EDGE.top, width: Math.max(this.x(place) - from, 1), height: this.size[1], class: "missing" }, this.curve);
        element("title", {}, band).textContent = words("unassembled");
        begin = null;
      }
    });
  }

  x(place) { return EDGE.left + (this.size[0] * (place - this.range[0])) / (this.range[1] - this.range[0] || 1); }

  y(value) { return EDGE.top + (this.size[1] * (this.high - value)) / (this.high - this.low); }

  /** Put the cursor at a place, and a dot on each line at its value. */
  mark(place, values) {
    if (!this.size) return;
    const x = this.x(place).toFixed(1);
    this.cursor.setAttribute("transform", `translate(${x} 0)`);
    values.forEach((value, k) => {
      const dot = this.dots.children[k];
      if (!dot) return;
      dot.setAttribute("display", value === null ? "none" : "inline");
      if (value !== null) dot.setAttribute("transform", `translate(${x} ${this.y(value).toFixed(1)})`);
    });
  }
}
