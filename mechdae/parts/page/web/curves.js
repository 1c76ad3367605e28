/** Curves of what is chosen in the diagram: a quantity and its two rates, one panel each. */
import { Chart, SILENCE } from "./chart.js";
import { bareAngle, pinned } from "./session.js";
import { lightable, mark, whenLit } from "./light.js";
import { find, made, written } from "./made.js";
import { element } from "./view.js";
import { sentence, words } from "./words.js";
import { quantity, rateOf } from "./units.js";

/** Least height of a panel [px], and how many things are told apart. */
const LEAST = 96, COLOURS = 5;
const SYMBOLS = { rad: ["φ", "ω", "ε"], m: ["s", "v", "a"], J: ["E"], 1: ["u", "u\u0307", "ü"], N: ["R"], "N m": ["M"], W: ["P"] };

export class Curves {
  /** @param {any} app @param {string} id of its panel @param {any[]} things what there is @param {any[]} begin what is chosen first */
  constructor(app, id, things, begin) {
    Object.assign(this, { app, id, things, chosen: begin.filter(Boolean), charts: new Map() });
    this.chips = made("div", { class: "chips" });
    this.more = made("select", { "aria-label": words("add_curve"), title: words("add_curve"), onchange: () => { this.toggle(this.things[Number(this.more.value)]); this.more.value = ""; } },
      made("option", { value: "" }, `+ ${words("add_curve")}`), ...things.map(({ name }, k) => made("option", { value: k }, name)));
    this.room = made("div", { class: "charts", style: `--least:${LEAST}px` });
    find(id).append(made("p", { class: "hint" }, words(id === "forces" ? "hint_forces" : app.session.live ? "hint_curves" : "hint_recorded")), this.chips, this.room, ...this.events());
  }

  /** What happens along the way, events of one kind at one part together. */
  events() {
    const { events } = this.app.along(), list = (times) => made("p", {}, times.map((at) => quantity(at, "s", 5)).join("; "));
    const rows = events.map(({ times, about }) => (times.length > 1 ? made("details", {}, made("summary", {}, about), list(times)) : made("p", {}, about)));
    return rows.length ? [made("div", { class: "events" }, ...rows)] : [];
  }

  /** Choose a thing, or choose it no more. */
  toggle(thing) {
    if (!thing) return;
    const { chosen } = this;
    this.chosen = chosen.includes(thing) ? chosen.filter((own) => own !== thing) : [...chosen, thing].slice(-COLOURS);
    this.whole();
    this.frame();
  }

  /** The thing of a part of the mechanism. */
  of(kind, part) { return this.things.find((own) => own.kind === kind && own.parts.includes(part)); }

  /** Draw the panels; `anew` where their places on the screen may be other ones. */
  whole(anew = true) {
    const { app, chosen } = this, { places, way, events } = app.along();
    const names = chosen.map(({ name }) => name).join();
    if (names !== this.named) this.chips.replaceChildren(...chosen.map((thing, k) => lightable(made("span", { class: `chip c${k}` }, thing.name, " ", made("output", {}),
      made("button", { type: "button", "aria-label": sentence("remove", thing.name), title: sentence("remove", thing.name), onclick: () => this.toggle(thing) }, "×")), `thing-${thing.parts[0]}`)), this.more);
    const panels = new Map();
    chosen.forEach((thing, k) => thing.lines.forEach((line) => {
      const key = `${line.unit} ${line.order}`;
      if (!panels.has(key)) panels.set(key, { unit: rateOf(line.unit, line.order), symbol: (SYMBOLS[line.unit] || [])[line.order] || line.unit, lines: [] });
      panels.get(key).lines.push({ ...line, look: `c${k}${line.dashed ? " dashed" : ""}` });
    }));
    for (const key of [...this.charts.keys()]) if (!panels.has(key)) { this.charts.get(key).svg.remove(); this.charts.delete(key); }
    const order = [...panels.keys()].sort((a, b) => Number(a.slice(-1)) - Number(b.slice(-1)));
    for (const key of order) {
      if (!this.charts.has(key)) {
        this.charts.set(key, new Chart(element("svg", { class: "chart", role: "img" }), (s) => app.want({ s })));
      }
      if (names !== this.named) this.room.append(this.charts.get(key).svg);
    }
    if (anew || names !== this.named) for (const chart of this.charts.values()) chart.rect = null;
    this.named = names;
    this.shown = order.map((key) => ({ chart: this.charts.get(key), ...panels.get(key) }));
    for (const [k, { chart, lines, symbol, unit }] of this.shown.entries()) {
      chart.svg.setAttribute("aria-label", `${symbol} (${way.name})`);
      chart.draw(places, lines.map(({ values, look }) => ({ values: values(), look })), { title: lines[0].title || symbol, unit, along: way.unit, foot: k + 1 === this.shown.length ? way.name : "", events });
    }
  }

  frame() {
    const { app } = this, at = app.session.value;
    for (const { chart, lines } of this.shown || []) chart.mark(at, lines.map(({ now }) => now()));
    if (app.reading) this.chosen.forEach((thing, k) => {
      const text = thing.lines.filter(({ order }) => order === 0).map(({ now, unit }) => quantity(now(), unit, 5)).join("; ");
      const own = this.chips.children[k].querySelector("output");
      if (own.textContent !== text) own.textContent = text;
    });
  }
}

/** A line of a panel: what `of` gives at poses, null for none. */
const lineOf = (session, of, unit, order, more = {}) => ({ unit, order, dashed: false, ...more, values: () => session.poses.map(of), now: () => of(session.pose) });

/** A line of an output by its path. */
function lineAt(session, path, unit, order, more) {
  const { scalar } = session.output(path), { start, pace } = session.data;
  const rounding = SILENCE * ({ rad: 1, m: start.scale }[unit] || 0) * pace ** order;
  const of = (pose) => { const value = pose && scalar(pose); return Number.isFinite(value) ? (Math.abs(value) < rounding ? 0 : value) : null; };
  return lineOf(session, of, unit, order, more);
}

/** Points that pins hold together are one; what stands still has no curves. */
export function thingsOf(app) {
  const { session, data } = app, { letters = {}, numbers = {} } = data.lesson, root = pinned(data.scene.joints);
  const fixed = new Set(data.scene.ground.map(root)), found = new Map();
  for (const entry of data.entries) {
    const { kind, part, columns, names, unit } = entry, key = kind === "points" ? root(part) : `${kind} ${part}`;
    if (kind === "points" && fixed.has(key)) continue;
    if (found.has(key)) { found.get(key).parts.push(part); continue; }
    const name = { points: `${words("point")} ${written(letters[part] || part)}`, bodies: `${numbers[part] ? `${numbers[part]} ` : ""}${part}`, joints: `${words("joint")} ${part}` }[kind];
    if (!name) continue;
    const line = (order, axis = "", dashed = false) => lineAt(session, `${kind}/${part}/${names[order]}${axis && `/${axis}`}`, unit, order, { dashed });
    const axes = columns.length > 1 && names[0] !== "orientation" ? [..."xyz"].slice(0, columns.length) : [];
    const lines = [...axes.map((axis, k) => line(0, axis, k > 0)), ...names.map((_, order) => order).filter((order) => (order ? !bareAngle(entry) : columns.length === 1)).map((order) => line(order))];
    found.set(key, { kind, parts: [part], name, lines, columns });
  }
  return [...found.values()];
}

/** Curves of a recorded motion: what was stored of links, slides, energies, places of points. */
export function recordedThings(session) {
  const stored = session.series.map(({ kind, part, names, unit, values }) => {
    const lines = names.map((_, order) => lineOf(session, ({ k }) => (Number.isFinite(values[order][k]) ? values[order][k] : null), unit, order, { title: unit === "J" ? words("energy") : "" }));
    return { kind, parts: [part], name: kind === "scalars" ? words(`${part}_energy`) : `${kind === "joints" ? `${words("joint")} ` : ""}${part}`, lines };
  });
  return [...stored, ...session.moving().map((part) => {
    const lines = [0, 1, 2].slice(0, session.data.scene.dimension).map((axis) => lineOf(session, (pose) => (session.place(part, pose) || [null, null, null])[axis], "m", 0, { dashed: axis > 0 }));
    return { kind: "points", parts: [part], name: `${words("point")} ${part}`, lines };
  })];
}

/** Efforts of drivers, reactions and losses of joints. */
export function forceThings(app) {
  const { session, data } = app, { efforts, joints, lossy, units } = data.forces;
  const thing = (kind, part, word, path, unit) => {
    const lines = [lineAt(session, path, unit, 0, { title: words(word) })];
    return { kind, parts: [part], name: `${words(word)} ${part}`, lines };
  };
  return [
    ...efforts.map((name) => thing("efforts", name, "effort", `efforts/${name}`, units[name])),
    ...joints.map(({ name }) => thing("joints", name, "reaction", `joints/${name}/reaction`, "N")),
    ...lossy.map((name) => thing("losses", name, "loss", `joints/${name}/loss`, "W"))];
}

/** Light the part of the diagram whose chip is pointed at. */
export const lightThings = ({ svg }) => whenLit((id) => mark(svg, "chosen", ["body", "joint", "point"], id.startsWith("thing-") ? [id.slice(6)] : []));
