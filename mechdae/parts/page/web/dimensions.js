/** Sliders of the dimensions, and their dimension lines in the diagram, which light up with each other. */
import { element } from "./view.js";
import { lightable, whenLit } from "./light.js";
import { find, made, written } from "./made.js";
import { SliderRow } from "./slider.js";
import { sentence, words } from "./words.js";
import { quantity } from "./units.js";

/** How far a dimension line is from what it measures, and from the next one; of angles the radius. */
const OFF = 17, NEXT = 15, TURNED = 30, LONG = 6, HEAD = 6, SUPPORT = 22;
/** So many lines are drawn together; of more only the one that is lit. */
const TOGETHER = 9;

export class Dimensions {
  /** @param {any} app */
  constructor(app) {
    this.app = app;
    const { data, session } = app;
    this.layer = element("g", { class: "dimensions" }, app.diagram.svg);
    if (session.live) this.build(data, session);
    else this.list(data);
  }

  /** Numbers that a recorded motion was computed with. */
  list(data) {
    const names = Object.keys(data.units).filter((name) => data.numbers[name] !== undefined && !name.includes("."));
    const rows = names.map((name) => made("tr", {}, made("td", {}, name), made("td", {}, quantity(data.numbers[name], data.units[name]))));
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
    const parts = k < 0 ? [] : data.lesson.dimensions[k].parts;
    for (const own of diagram.svg.querySelectorAll("[data-id]")) {
      const [kind, name] = own.getAttribute("data-id").split("-");
      own.classList.toggle("bright", ["body", "joint", "load", "mass"].includes(kind) && parts.includes(name));
    }
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
    for (const line of this.lines) {
      const shown = (open && few) || line.k === this.one;
      const at = shown && this.placed(line, this.places, angles);
      line.made.setAttribute("display", at ? "inline" : "none");
      if (!at) continue;
      const [[x, y], turn, form] = at;
      line.made.setAttribute("transform", `translate(${x.toFixed(2)} ${y.toFixed(2)}) rotate(${((turn * 180) / Math.PI).toFixed(2)})`);
      const upright = Math.cos(turn) < -1e-6 || (Math.cos(turn) < 1e-6 && Math.sin(turn) > 0) ? -1 : 1, // upwards it is read from the right
        key = `${form.map((v) => v.toFixed(1))} ${upright}`;
      if (line.key !== key) { line.key = key; this.drawn(line, form, upright); }
    }
  }

  /** Where a line begins, its angle on the sheet, and (length, where the other point is across, which side). */
  placed({ kind, body, from, to, k }, places, angles) {
    const { diagram, session } = this.app, turn = body === "ground" ? 0 : angles[body];
    const joint = this.app.data.scene.joints.find(({ name }) => name === body);
    const a = places[kind === "radius" && to === "roller_radius" ? joint.second : from];
    if (!a) return null;
    const start = diagram.at(a);
    if (kind === "radius") {
      const reach = Math.abs(session.theta[k]) * diagram.scale;
      return reach < 9 ? null : [start, -Math.PI / 4, [reach, 0, 0]];
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

  drawn({ made: own, k, level, body }, [long, across, side], upright) {
    own.replaceChildren();
    const { name } = this.app.data.sliders[k];
    const letters = (x, y, turned) => {
      const text = element("text", { x: 0, y: 0, transform: `translate(${x.toFixed(2)} ${y.toFixed(2)})${turned}`, class: "name" }, own);
      text.textContent = written(name);
    };
    if (side === 2) { // an angle, counter-clockwise
      const [c, s] = [Math.cos(long), -Math.sin(long)], r = TURNED + NEXT * level;
      element("path", { d: `M0 0H${r + 8}M0 0L${((r + 8) * c).toFixed(2)} ${((r + 8) * s).toFixed(2)}M${r} 0A${r} ${r} 0 ${Math.abs(long) > Math.PI ? 1 : 0} ${long > 0 ? 0 : 1} ${(r * c).toFixed(2)} ${(r * s).toFixed(2)}` }, own);
      letters((r + 12) * Math.cos(long / 2), -(r + 12) * Math.sin(long / 2), "");
      return;
    }
    const off = side * (OFF + NEXT * level + (body === "ground" ? SUPPORT : 0)), edge = off + Math.sign(off) * LONG;
    const heads = long > 3 * HEAD ? `M${HEAD} ${off - 2.2}L0 ${off}L${HEAD} ${off + 2.2}M${long - HEAD} ${off - 2.2}L${long} ${off}L${long - HEAD} ${off + 2.2}` : "";
    const ways = side ? `M0 ${Math.sign(off) * 5}V${edge}M${long} ${across ? across : Math.sign(off) * 5}V${edge}` : "";
    element("path", { d: `M0 ${off}H${long}`, class: "area" }, own);
    element("path", { d: `M0 ${off}H${long}${heads}`, class: "main" }, own);
    element("path", { d: ways, class: "way" }, own);
    letters(0.38 * long, off, upright < 0 ? " rotate(180)" : "");
  }
}
