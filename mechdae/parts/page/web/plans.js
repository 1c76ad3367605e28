/** Vector polygons of the pose shown: velocities and accelerations from their poles, forces on a group. */
import { arrow, element } from "./view.js";
import { lightable } from "./light.js";
import { find, indexed, made, written } from "./made.js";
import { words } from "./words.js";
import { digits, displayed } from "./units.js";

/** Ends so near have one text, with so many letters; shorter arrows have no name; more arrows than this only where their names cover few places of lines. */
const MERGED = 9, NAMED = 4, SHORTEST = 26, MOST_ARROWS = 16, COVERS = 2;
/** Width of a letter of an index, and of one of an end; half the height of a text and the room beside it [px]. */
const SMALL = 4.8, WIDE = 6.6, HIGH = 8, NEXT_TO = 5;
/** Lines are told by places so far apart [px]; what it costs to cover a text, or to be cut off. */
const DENSE = 6, COVERED = 40, CUT = 100;
const AROUND = [0, 1, -1, 2, -2, 3, -3, 4];

export class Plans {
  /** @param {any} app @param {() => void} redraw */
  constructor(app, redraw) {
    this.app = app;
    const options = [["both", `${words("velocity")}, ${words("acceleration")}`], ["1", words("velocity")], ["2", words("acceleration")]];
    if (app.session.forces) app.data.lesson.groups.forEach(({ name }, k) => options.push([`forces ${k}`, `${words("acting")} ${name}`]));
    this.choice = made("select", { "aria-label": words("plans"), title: words("about_plans"), onchange: redraw }, ...options.map(([value, text]) => made("option", { value }, text)));
    this.sheets = [1, 2].map((order) => planSheet(`${words("plan")}: ${words(order === 1 ? "velocity" : "acceleration")}`));
    find("plans").append(made("p", { class: "hint" }, words("hint_plans")), this.choice, ...this.sheets);
  }

  /** Forget how large the sheets are. */
  whole(anew) { if (anew) for (const svg of this.sheets) svg.room = null; }

  frame() {
    const what = this.choice.value, group = what.startsWith("forces ") ? Number(what.slice(7)) : null;
    const orders = group !== null ? [1] : what === "both" ? [1, 2] : [Number(what)];
    if (what !== this.shown) this.sheets.forEach((svg, k) => { svg.style.display = orders.includes(k + 1) ? "block" : "none"; svg.room = null; });
    this.shown = what;
    const equations = group === null && this.app.equations(), balance = group === null ? null : this.app.balance();
    for (const order of orders) drawPlan(this.sheets[order - 1], balance ? balance.plan(group) : equations && equations.rated ? equations.plan(order) : null, group === null ? words(order === 1 ? "velocity" : "acceleration") : "");
  }
}

/** A picture for a plan. */
export const planSheet = (label) => element("svg", { class: "plan", role: "img", "aria-label": label });

/** Write a symbol with its indices into a picture. */
function letterIn(group, x, y, [letter, low, high], anchor = "middle") {
  const text = element("text", { x: x.toFixed(1), y: y.toFixed(1), class: "vector-name", "text-anchor": anchor }, group);
  const part = (value, dx, dy, kind) => { element("tspan", { dx, dy, class: kind }, text).textContent = value; };
  part(letter, 0, 0, "big");
  if (high) part(high, 0, -5, "small");
  if (low) part(indexed(low), high ? -SMALL * high.length : 0, high ? 8 : 3, "small"); // below the upper one
}

/** Ends with those nearer than letters can be told apart; of many the first ones are named. */
function merged(ends) {
  const found = [];
  for (const { text, at } of ends) {
    const near = found.find((own) => Math.hypot(own.at[0] - at[0], own.at[1] - at[1]) < MERGED);
    if (near) near.texts.push(...text.split(", "));
    else found.push({ at, texts: text.split(", ") });
  }
  return found.map(({ at, texts }) => ({ at, text: texts.length > NAMED ? `${texts.slice(0, NAMED).join(", ")} …` : texts.join(", ") }));
}

/** Places on a line from its start to its end. */
function dotted([a, b]) {
  const count = Math.ceil(Math.hypot(b[0] - a[0], b[1] - a[1]) / DENSE) || 1;
  return Array.from({ length: count + 1 }, (_, k) => [0, 1].map((i) => a[i] + (k / count) * (b[i] - a[i])));
}

/** Draw a plan to the largest scale of 1, 2, 2.5, 4, 5 that fits. */
export function drawPlan(svg, plan, title) {
  svg.replaceChildren();
  const { width, height } = (svg.room ||= svg.getBoundingClientRect()); // looked up once: it makes the browser lay out
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  const note = (text, y) => { element("text", { x: 8, y, class: "tick" }, svg).textContent = text; };
  if (title) note(title, 13);
  const missing = plan ? (plan.arrows.length ? "" : "all_zero") : "none";
  if (missing) note(words(missing), 30);
  if (missing || !(width > 0)) return;
  const { arrows, lines, ends, unit } = plan;
  const every = [[0, 0], ...arrows.flatMap(({ from, to }) => [from, to])];
  const [xs, ys] = [0, 1].map((k) => every.map((own) => own[k]));
  const [left, right, low, high] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  const fit = Math.min((width - 70) / Math.max(right - left, 1e-300), (height - 74) / Math.max(high - low, 1e-300));
  const power = 10 ** Math.floor(Math.log10(fit));
  const scale = power * [5, 4, 2.5, 2, 1].find((k) => k * power <= fit * (1 + 1e-12));
  const at = ([x, y]) => [width / 2 + scale * (x - (left + right) / 2), height / 2 - scale * (y - (low + high) / 2)];
  for (const [a, b] of lines) {
    const [[x1, y1], [x2, y2]] = [at(a), at(b)];
    element("line", { x1, y1, x2, y2, class: "image" }, svg);
  }
  const shown = arrows.map((own) => ({ ...own, ends: [at(own.from), at(own.to)] })).filter(({ ends: [a, b] }) => Math.hypot(b[0] - a[0], b[1] - a[1]) > 1);
  const covered = [...shown.map((own) => own.ends), ...lines.map((own) => own.map(at))].flatMap(dotted), boxes = [[45, 9, 45], [60, height - 10, 60]];
  /** Where a text covers least, the first of the best places, which it takes; undefined where that costs more than `most`. */
  const placed = (places, wide, most = Infinity) => {
    const cost = ([x, y], k) => 0.05 * k + covered.filter(([u, v]) => Math.abs(u - x) < wide / 2 && Math.abs(v - y) < HIGH).length
      + COVERED * boxes.filter(([u, v, half]) => Math.abs(u - x) < wide / 2 + half && Math.abs(v - y) < 2 * HIGH).length
      + CUT * Number(Math.abs(x - width / 2) > (width - wide) / 2 || Math.abs(y - height / 2) > height / 2 - HIGH);
    const costs = places.map(cost), least = Math.min(...costs);
    if (least > most) return undefined;
    const [x, y] = places[costs.indexOf(least)];
    boxes.push([x, y, wide / 2]);
    return [x, y + 4];
  };
  const middle = at([(left + right) / 2, (low + high) / 2]);
  for (const { text, at: [x, y] } of merged(ends.map((own) => ({ ...own, at: at(own.at) })))) {
    const label = written(text), wide = WIDE * label.length, away = Math.atan2(y - middle[1], x - middle[0]);
    const places = [1, 2.2].flatMap((far) => AROUND.map((turn) => away + (turn * Math.PI) / 4).map((turn) => [x + Math.cos(turn) * far * (NEXT_TO + wide / 2), y + Math.sin(turn) * far * (NEXT_TO + HIGH)]));
    const [u, v] = placed(places, wide);
    element("text", { x: u.toFixed(1), y: v.toFixed(1), class: "end" }, svg).textContent = label;
    element("circle", { cx: x, cy: y, r: 1.6, class: "end-dot" }, svg);
  }
  for (const { id, ends: [a, b], kind, letter } of shown) {
    const way = [b[0] - a[0], b[1] - a[1]], size = Math.hypot(...way), group = lightable(element("g", { class: `vector ${kind}` }, svg), id);
    arrow(group, a, way, size, "");
    if (!letter || size < SHORTEST) continue;
    const wide = 2 * SMALL * (1 + 0.5 * Math.max(letter[1].length, letter[2].length)), [dx, dy] = [way[1] / size, -way[0] / size];
    const off = Math.abs(dx) * (wide / 2) + Math.abs(dy) * HIGH + NEXT_TO;
    const places = [0, 0.22, -0.22, 0.36, -0.36].flatMap((t) => [1, -1].map((side) => [0, 1].map((k) => (a[k] + b[k]) / 2 + t * way[k] + side * off * [dx, dy][k])));
    const spot = placed(places, wide, arrows.length > MOST_ARROWS ? COVERS : COVERED / 2); // the table names it, lit
    if (spot) letterIn(group, ...spot, letter);
  }
  const [factor, name] = displayed(unit);
  note(`50 px = ${digits((50 / scale) * factor, 4)} ${name}`, height - 6);
}
