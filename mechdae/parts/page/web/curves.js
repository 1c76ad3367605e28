/** Curves of what is chosen in the diagram: a quantity and its two rates, one panel each. */
import { Chart } from "./chart.js";
import { bareAngle } from "./session.js";
import { lightable, whenLit } from "./light.js";
import { find, made, written } from "./made.js";
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
    find(id).append(made("p", { class: "hint" }, words(id === "forces" ? "hint_forces" : app.session ? "hint_curves" : "hint_recorded")), this.chips, this.room);
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
    chosen.forEach((thing, k) => thing.lines().forEach((line) => {
      const key = `${line.unit} ${line.order}`;
      if (!panels.has(key)) panels.set(key, { unit: rateOf(line.unit, line.order), symbol: (SYMBOLS[line.unit] || [])[line.order] || line.unit, lines: [] });
      panels.get(key).lines.push({ ...line, look: `c${k}${line.dashed ? " dashed" : ""}` });
    }));
    for (const key of [...this.charts.keys()]) if (!panels.has(key)) { this.charts.get(key).svg.remove(); this.charts.delete(key); }
    const order = [...panels.keys()].sort((a, b) => Number(a.slice(-1)) - Number(b.slice(-1)));
    for (const key of order) {
      if (!this.charts.has(key)) {
        const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
        for (const [name, value] of Object.entries({ class: "chart", role: "img" })) svg.setAttribute(name, value);
        this.charts.set(key, new Chart(svg, (s) => app.want({ s })));
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
    const { app } = this, at = app.place;
    for (const { chart, lines } of this.shown || []) chart.mark(at, lines.map(({ now }) => now()));
    if (app.reading) this.chosen.forEach((thing, k) => {
      const text = thing.lines().filter(({ order }) => order === 0).map(({ now, unit }) => quantity(now(), unit, 5)).join("; ");
      const own = this.chips.children[k].querySelector("output");
      if (own.textContent !== text) own.textContent = text;
    });
  }
}

/** Points that pins hold together are one; what stands still has no curves. */
export function thingsOf(app) {
  const { session, data } = app, { letters = {}, numbers = {} } = data.lesson;
  const same = new Map();
  const root = (name) => { let own = name; while (same.has(own)) own = same.get(own); return own; };
  for (const { pin, first, second } of data.scene.joints) if (pin && root(first) !== root(second)) same.set(root(second), root(first));
  const fixed = new Set(data.scene.ground.map(root)), found = new Map();
  const line = (entry, order, component, dashed = false) => {
    const number = (pose) => {
      const own = pose && session.told(pose, entry, order);
      return own && own.every(Number.isFinite) ? (component === null ? Math.hypot(...own) : own[component]) : null;
    };
    return { unit: entry.unit, order, dashed, values: () => session.poses.map(number), now: () => number(session.pose) };
  };
  for (const entry of data.entries) {
    const { kind, part, columns, names } = entry;
    const key = kind === "points" ? root(part) : `${kind} ${part}`;
    if (kind === "points" && fixed.has(key)) continue;
    if (found.has(key)) { found.get(key).parts.push(part); continue; }
    const many = columns.length > 1, orders = bareAngle(entry) ? [0] : names.map((_, order) => order);
    const title = { points: `${words("point")} ${written(letters[part] || part)}`, bodies: `${numbers[part] ? `${numbers[part]} ` : ""}${part}`, joints: `${words("joint")} ${part}` }[kind];
    if (!title) continue;
    const axes = names[0] === "orientation" ? [] : columns.map((_, axis) => line(entry, 0, axis, axis > 0));
    const lines = many ? [...axes, ...orders.slice(1).map((order) => line(entry, order, null))] : orders.map((order) => line(entry, order, 0));
    found.set(key, { kind, parts: [part], name: title, lines: () => lines, columns });
  }
  return [...found.values()];
}

/** Curves of a recorded motion: places of points, what was stored of links, slides, energies. */
export function recordedThings(app) {
  const { recorded } = app;
  const found = recorded.series.map(({ kind, part, names, unit, values }) => {
    const lines = names.map((_, order) => ({ unit, order, dashed: false, values: () => values[order], now: () => values[order][app.shown], title: unit === "J" ? words("energy") : "" }));
    return { kind, parts: [part], name: kind === "scalars" ? words(`${part}_energy`) : `${kind === "joints" ? `${words("joint")} ` : ""}${part}`, lines: () => lines };
  });
  for (const part of recorded.moving()) {
    const lines = [0, 1, 2].slice(0, app.data.scene.dimension).map((axis) => ({ unit: "m", order: 0, dashed: axis > 0, values: () => recorded.track(part, axis), now: () => recorded.track(part, axis)[app.shown] }));
    found.push({ kind: "points", parts: [part], name: `${words("point")} ${part}`, lines: () => lines });
  }
  return found;
}

/** Efforts of drivers, reactions and losses of joints. */
export function forceThings(app) {
  const { session, data } = app, { efforts, joints, lossy, units } = data.forces;
  const thing = (kind, part, name, path, unit, title) => {
    const { scalar } = session.output(path);
    const lines = [{ unit, order: 0, dashed: false, title, values: () => session.poses.map(scalar), now: () => scalar(session.pose) }];
    return { kind, parts: [part], name, lines: () => lines };
  };
  return [
    ...efforts.map((name) => thing("efforts", name, `${words("effort")} ${name}`, `efforts/${name}`, units[name], words("effort"))),
    ...joints.map(({ name }) => thing("joints", name, `${words("reaction")} ${name}`, `joints/${name}/reaction`, "N", words("reaction"))),
    ...lossy.map((name) => thing("losses", name, `${words("loss")} ${name}`, `joints/${name}/loss`, "W", words("loss")))];
}

/** Light the part of the diagram whose chip is pointed at. */
export function lightThings(diagram) {
  whenLit((id) => {
    const part = id.startsWith("thing-") ? id.slice(6) : "";
    for (const own of diagram.svg.querySelectorAll("[data-id]")) {
      const name = own.getAttribute("data-id");
      if (part || own.classList.contains("chosen")) own.classList.toggle("chosen", Boolean(part) && [`body-${part}`, `joint-${part}`, `point-${part}`].some((start) => name.startsWith(start)));
    }
  });
}
