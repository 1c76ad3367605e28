/** Sliders of the dimensions, and their dimension lines in the diagram, which light up with each other. */
import { element } from "./view.js";
import { lightable, mark, whenLit } from "./light.js";
import { find, made, rowOf, written } from "./made.js";
import { SliderRow } from "./slider.js";
import { sentence, words } from "./words.js";
import { quantity } from "./units.js";

/** How far a dimension line is from what it measures, and from the next one; of angles the radius. */
const OFF = 17, NEXT = 15, TURNED = 30, LONG = 6, HEAD = 6, SUPPORT = 22;
/** So many lines are drawn together; of more only the one that is lit. */
const TOGETHER = 9;
/** Where a letter may stand: share of its line, and how far beyond [units]; nearer than `FREE` to something it goes where there is more room. */
const STANDS = [[0.38, 0], [0.62, 0], [0.22, 0], [0.78, 0], [1, 12], [0, -12]], FREE = 15;
/** Directions of radii on the sheet. */
const RADIAL = [-1, -3, 1, 3].map((k) => (k * Math.PI) / 4);

export class Dimensions {
  /** @param {any} app */
  constructor(app) {
    this.app = app;
    const { data, session } = app;
    this.layer = element("g", { class: "dimensions" });
    app.diagram.svg.insertBefore(this.layer, app.diagram.layers.parts);
    if (session.live) this.build(data, session);
    else this.list(data);
  }

  /** Numbers that a recorded motion was computed with. */
  list(data) {
    const names = Object.keys(data.units).filter((name) => data.numbers[name] !== undefined && !name.includes("."));
    const rows = names.map((name) => rowOf(name, quantity(data.numbers[name], data.units[name])));
    find("dimensions").append(made("p", { class: "hint" }, words("given")), made("table", {}, made("tbody", {}, ...rows)));
  }

  build(data, session) {
    const { app } = this;
    const begin = () => session.remember();
    this.rows = data.sliders.map(({ name, low, value, high }, k) => {
      const row = new SliderRow(name, (data.units || {})[name] || "m", [low, value, high], (changed) => app.want({ theta: [k, changed] }), { begin, title: sentence("drag_number", name), about: words("type_number") });
      lightable(row.row, `dim-${k}`);
      return row;
    });
    const box = made("div", { class: "rows" }, ...this.rows.map(({ row }) => row));
    const act = (key, run) => made("button", { type: "button", title: words(`about_${key}`), onclick: run }, words(key));
    find("dimensions").append(box, made("div", { class: "acts" }, act("reset", () => app.reset()), act("undo", () => app.undo(true)), act("redo", () => app.undo(false))));
    const taken = {};
    this.lines = (data.lesson ? data.lesson.dimensions : []).flatMap(({ lines }, k) => lines.map(([kind, body, from, to]) => {
      const way = `${body} ${kind === "y" ? "across" : "along"}`;
      taken[way] = (taken[way] || 0) + 1;
      return { k, kind, body, from, to, level: taken[way] - 1 };
    }));
    for (const line of this.lines) {
      line.made = lightable(element("g", { class: "dimension", "data-of": line.k }, this.layer), `dim-${line.k}`);
      line.made.addEventListener("pointerdown", (event) => {
        if (app.hand.grip(app.hand.at(event))) return; // a point is nearer
        event.stopPropagation();
        this.rows[line.k].range.focus();
      });
    }
    whenLit((id) => this.show(id));
  }

  /** Light the parts that a number belongs to, and its line where not all are drawn. */
  show(id) {
    const { data, diagram } = this.app, k = id.startsWith("dim-") ? Number(id.slice(4)) : -1;
    mark(diagram.svg, "bright", ["body", "joint", "load", "mass"], k < 0 ? [] : data.lesson.dimensions[k].parts);
    this.one = k;
    if (this.places) this.frame();
  }

  whole() { (this.rows || []).forEach((row, k) => row.show(this.app.session.theta[k])); }

  /** Put the lines where the links are: those that keep their length are only moved. */
  frame() {
    const { app } = this, { session, diagram } = app;
    if (!session.live || !this.lines) return;
    this.places = app.now();
    const angles = app.turned(), open = app.tabs.shown === "dimensions";
    const few = this.lines.length <= TOGETHER && !app.data.scene.space;
    const drawn = [], seen = new Set();
    if (app.reading || !this.taken) this.taken = this.obstacles();
    for (const line of this.lines) {
      const shown = (open && few) || line.k === this.one;
      const at = shown && this.placed(line, this.places, angles), spot = at && `${line.k} ${at.flat(2).map((v) => v.toFixed(1))}`;
      line.made.setAttribute("display", at && !seen.has(spot) ? "inline" : "none"); // two joints may have one radius
      if (!at || seen.has(spot)) continue;
      seen.add(spot);
      const [[x, y], turn, form] = at;
      line.made.setAttribute("transform", `translate(${x.toFixed(2)} ${y.toFixed(2)}) rotate(${((turn * 180) / Math.PI).toFixed(2)})`);
      const upright = Math.cos(turn) < -1e-6 || (Math.cos(turn) < 1e-6 && Math.sin(turn) > 0) ? -1 : 1, // upwards it is read from the right
        key = `${form.map((v) => v.toFixed(1))} ${upright}`;
      if (line.key !== key) { line.key = key; this.drawn(line, form, upright); }
      if (form[2] !== 2) drawn.push([line, at]);
    }
    this.place(drawn, app.reading);
  }

  /** Spots on the sheet that letters keep clear of: pins, places along links, the diagram's letters. */
  obstacles() {
    const { diagram } = this.app, bodies = new Map(), spots = [];
    for (const [name, place] of Object.entries(this.places)) {
      const [body] = name.split("."), here = diagram.at(place), before = body !== "ground" && bodies.get(body);
      for (const t of before ? [0.2, 0.4, 0.6, 0.8] : []) spots.push([0, 1].map((i) => before[i] + t * (here[i] - before[i])));
      bodies.set(body, here);
      spots.push(here);
    }
    for (const { spot } of diagram.elements || []) if (spot) spots.push(spot);
    return spots;
  }

  /** How far a spot is from the nearest obstacle. */
  room(spot) { return Math.min(...this.taken.map(([x, y]) => Math.hypot(x - spot[0], y - spot[1]))); }

  /** What is used now unless it has too little room; then the roomiest. */
  clear(all, now, spotOf) {
    const room = (own) => this.room(spotOf(own));
    return room(now) < FREE ? all.reduce((best, own) => (room(own) > room(best) + 2 ? own : best), now) : now;
  }

  /** Put letters on their lines clear of pins, of the diagram's letters and of each other; none goes elsewhere without need. */
  place(drawn, anew) {
    for (const [line, [[x, y], turn, [long]]] of drawn) {
      const [c, s] = [Math.cos(turn), Math.sin(turn)], along = ([share, beyond]) => share * long + beyond;
      const spot = (stand) => [x + c * along(stand) - s * line.off, y + s * along(stand) + c * line.off];
      if (anew || !line.stand) line.stand = this.clear(STANDS, line.stand || STANDS[0], spot);
      line.letter.setAttribute("transform", `translate(${along(line.stand).toFixed(2)} ${line.off})${line.upright < 0 ? " rotate(180)" : ""}`);
      if (anew) this.taken.push(spot(line.stand));
    }
  }

  /** Where a line begins, its angle on the sheet, and (length, where the other point is across, which side). */
  placed(line, places, angles) {
    const { kind, body, from, to, k } = line, { diagram, session } = this.app, turn = body === "ground" ? 0 : angles[body];
    const joint = this.app.data.scene.joints.find(({ name }) => name === body);
    const a = places[kind === "radius" && to === "roller_radius" ? joint.second : from];
    if (!a) return null;
    const start = diagram.at(a);
    if (kind === "radius") {
      const reach = Math.abs(session.theta[k]) * diagram.scale;
      if (reach < 9) return null;
      if (this.app.reading || line.turn === undefined) line.turn = this.clear(RADIAL, line.turn ?? RADIAL[0], (way) => [start[0] + (reach + 12) * Math.cos(way), start[1] + (reach + 12) * Math.sin(way)]);
      return [start, line.turn, [reach, 0, 0]];
    }
    if (kind === "axis" || kind === "angle") {
      const base = kind === "axis" ? angles[joint.first.split(".")[0]] || 0 : turn;
      return base === undefined ? null : [start, -base, [session.theta[k], 0, 2]];
    }
    const b = places[to];
    if (!b) return null;
    const end = diagram.at(b), way = [end[0] - start[0], end[1] - start[1]];
    if (kind === "length" || a.length === 3) return [start, Math.atan2(way[1], way[0]), [Math.hypot(...way), 0, this.side(body, from, to, places)]];
    if (turn === undefined) return null;
    const axis = -turn - (kind === "y" ? Math.PI / 2 : 0), along = way[0] * Math.cos(axis) + way[1] * Math.sin(axis);
    const sense = along < 0 ? Math.PI : 0, across = way[1] * Math.cos(axis + sense) - way[0] * Math.sin(axis + sense);
    return [start, axis + sense, [Math.abs(along), across, across > 0 ? -1 : 1]];
  }

  /** The side of a line away from the rest of its body: 1 below. */
  side(body, from, to, places) {
    const at = (name) => this.app.diagram.at(places[name]), [a, b] = [at(from), at(to)];
    const others = Object.keys(places).filter((name) => name.startsWith(`${body}.`) && name !== from && name !== to).map(at);
    const sum = others.reduce((all, [x, y]) => all + (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]), 0);
    return sum > 1e-6 ? -1 : 1;
  }

  drawn(line, [long, across, side], upright) {
    const { made: own, k, level, body } = line, letter = (line.letter = element("text", { x: 0, y: 0, class: "name" }));
    const [name, low] = written(this.app.data.sliders[k].name).split(/_(.*)/);
    letter.textContent = name;
    if (low) element("tspan", { dy: 3, "font-size": "75%" }, letter).textContent = low;
    own.replaceChildren();
    if (side === 2) { // an angle, counter-clockwise
      const [c, s] = [Math.cos(long), -Math.sin(long)], r = TURNED + NEXT * level;
      element("path", { d: `M0 0H${r + 8}M0 0L${((r + 8) * c).toFixed(2)} ${((r + 8) * s).toFixed(2)}M${r} 0A${r} ${r} 0 ${Math.abs(long) > Math.PI ? 1 : 0} ${long > 0 ? 0 : 1} ${(r * c).toFixed(2)} ${(r * s).toFixed(2)}` }, own);
      letter.setAttribute("transform", `translate(${((r + 12) * Math.cos(long / 2)).toFixed(2)} ${(-(r + 12) * Math.sin(long / 2)).toFixed(2)})`);
      own.append(letter);
      return;
    }
    const off = side * (OFF + NEXT * level + (body === "ground" ? SUPPORT : 0)), edge = off + Math.sign(off) * LONG;
    const heads = long > 3 * HEAD ? `M${HEAD} ${off - 2.2}L0 ${off}L${HEAD} ${off + 2.2}M${long - HEAD} ${off - 2.2}L${long} ${off}L${long - HEAD} ${off + 2.2}` : "";
    const ways = side ? `M0 ${Math.sign(off) * 5}V${edge}M${long} ${across ? across : Math.sign(off) * 5}V${edge}` : "";
    element("path", { d: `M0 ${off}H${long}`, class: "area" }, own);
    element("path", { d: `M0 ${off}H${long}${heads}`, class: "main" }, own);
    element("path", { d: ways, class: "way" }, own);
    Object.assign(line, { off, upright });
    own.append(letter);
  }
}
