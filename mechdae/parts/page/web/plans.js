/** Vector polygons of the pose shown: velocities and accelerations from their poles, forces on a group. */
import { arrow, element } from "./view.js";
import { lightable } from "./light.js";
import { find, indexed, made, written } from "./made.js";
import { words } from "./words.js";
import { digits, displayed } from "./units.js";

/** How far letters are from their ends [px]; ends so near have one text, with so many letters; names of arrows nearer than this to another one are left out, farther ones too where there are many. */
const APART = 13, MERGED = 9, NAMED = 4, CLEAR = [8, 26], MOST_ARROWS = 16;
/** Width of a letter of an index [px]. */
const SMALL = 4.8;

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
export function planSheet(label) {
  const svg = element("svg", { class: "plan", role: "img", "aria-label": label });
  return svg;
}

/** Write a symbol with its indices into a picture. */
export function letterIn(group, x, y, [letter, low, high], anchor = "middle") {
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

/** Draw a plan to the largest scale of 1, 2, 2.5, 4, 5 that fits. */
export function drawPlan(svg, plan, title) {
  svg.replaceChildren();
  const { width, height } = (svg.room ||= svg.getBoundingClientRect()); // looked up once: it makes the browser lay out
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  const note = (text, y) => { element("text", { x: 8, y, class: "tick" }, svg).textContent = text; };
  if (title) note(title, 13);
  if (!plan || !(width > 0)) { if (!plan) note(words("none"), 30); return; }
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
  const taken = ends.map(({ at: place }) => at(place));
  for (const { id, from, to, kind, letter } of arrows) {
    const [a, b] = [at(from), at(to)], size = Math.hypot(b[0] - a[0], b[1] - a[1]);
    if (!(size > 1)) continue;
    const group = lightable(element("g", { class: `vector ${kind}` }, svg), id);
    arrow(group, a, [b[0] - a[0], b[1] - a[1]], size, "");
    if (!letter || size < 26) continue;
    const [dx, dy] = [(b[1] - a[1]) / size, (a[0] - b[0]) / size], [mx, my] = [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
    const spots = [[0, 1], [0, -1], [0.22, 1], [0.22, -1], [-0.22, 1], [-0.22, -1]].map(([t, side]) => [mx + t * (b[0] - a[0]) + 14 * side * dx, my + t * (b[1] - a[1]) + 14 * side * dy]);
    const room = (spot) => Math.min(99, ...taken.map(([x, y]) => Math.hypot(x - spot[0], 1.5 * (y - spot[1]))));
    const best = spots.reduce((one, two) => (room(two) > room(one) + 6 ? two : one));
    if (room(best) < CLEAR[Number(arrows.length > MOST_ARROWS)]) continue; // the table names it, lit
    taken.push(best);
    letterIn(group, best[0], best[1] + 4, letter);
  }
  const middle = at([(left + right) / 2, (low + high) / 2]);
  for (const { text, at: [x, y] } of merged(ends.map((own) => ({ ...own, at: at(own.at) })))) {
    const far = Math.hypot(x - middle[0], y - middle[1]) || 1;
    element("text", { x: (x + (APART * (x - middle[0])) / far).toFixed(1), y: (y + (APART * (y - middle[1])) / far + 4).toFixed(1), class: "end" }, svg).textContent = written(text);
    element("circle", { cx: x, cy: y, r: 1.6, class: "end-dot" }, svg);
  }
  const [factor, name] = displayed(unit);
  note(`50 px = ${digits((50 / scale) * factor, 4)} ${name}`, height - 6);
}
