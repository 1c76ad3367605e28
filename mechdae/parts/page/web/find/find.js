/** Finding linkages with the mouse: poses of a body, points of a curve, a curve that is drawn; thumbnails of what does it, each followed by the page's solver. */
import { element, pathOf } from "../view.js";
import { offered } from "../files.js";
import { made } from "../made.js";
import { digits } from "../units.js";
import { words } from "../words.js";
import { Atlas } from "./atlas.js";
import { missOfCurve, missOfPoses } from "./checked.js";
import { direction, minus, norm } from "./complex.js";
import { Search } from "./curves.js";
import { factsOf, ofCurve, ofPoses } from "./drawn.js";
import { linkageOf, motionsOf } from "./motions.js";
import { extent, smoothThrough } from "./targets.js";
import { taskText } from "./task.js";
import { pairs, thumbOf } from "./thumbs.js";

const nothing = () => ({ poses: [], pivots: [], points: [], curve: [] });
const KINDS = { poses: [2, 5], pivots: [0, 2], points: [5, 9], curve: [12, Infinity] };
/** How near the pointer takes hold, units; length of an arrow; milliseconds of work between two pictures; fits of a search; how many are shown, how many of them are waited for, how many of each class; the largest miss of a pose. */
const HOLD = 12, ARROW = 42, SLICE = 24, FITS = 600, SHOWN = 12, FIRST = 3, OF_A_CLASS = 4, TRUE = 1e-6;

export class Finder {
  /** @param {any} view the diagram: at, from @param {HTMLElement[]} places where buttons go, and thumbnails @param {(drawing: any) => void} use what takes a drawing
   * @param {() => void} drawn asks for a new picture */
  constructor(view, [place, thumbs], use, drawn) {
    Object.assign(this, { view, thumbs, use, drawn, kind: "poses", task: nothing(), round: 0 });
    this.forgets();
    this.layer = element("g", { class: "finder" });
    const bar = made("div", { class: "row-of-tools" });
    const button = (key, act) => { const own = made("button", { type: "button", onclick: act }, words(key)); bar.append(own); return own; };
    this.kinds = Object.fromEntries(Object.keys(KINDS).map((kind) => [kind, button(`find_${kind}`, () => this.choose(kind))]));
    this.start = button("find_start", () => this.search());
    this.clear = button("find_clear", () => this.reset());
    this.save = button("find_save", () => offered("task.toml", this.toml(), "text/plain"));
    this.note = made("p", { role: "status" });
    place.append(bar, this.note);
    this.shown();
  }

  choose(kind) {
    this.kind = kind;
    if (kind === "points" || kind === "curve") this.grow();
    this.changed();
  }

  reset() {
    this.task = nothing();
    this.changed();
  }

  /** What is sought was changed: what was found no longer counts. */
  changed() {
    this.round += 1;
    this.forgets();
    this.show();
  }

  forgets() { Object.assign(this, { busy: false, found: [], dyads: [], picked: [], chosen: -1, took: null }); }

  show() {
    this.shown();
    this.drawn();
  }

  /** Whether poses are sought, or points or a curve. */
  get ofPoses() { return this.kind === "poses" || this.kind === "pivots"; }

  get enough() {
    const kind = this.ofPoses ? "poses" : this.kind, [least, most] = KINDS[kind], { length } = this.task[kind];
    return length >= least && length <= most;
  }

  // -- pointer; places are units of the picture

  near(list, [x, y]) { return list.findIndex((own) => { const [u, v] = this.view.at(own); return Math.hypot(u - x, v - y) < HOLD; }); }

  tip([x, y, angle]) { const [u, v] = this.view.at([x, y]); return [u + ARROW * Math.cos(angle), v - ARROW * Math.sin(angle)]; }

  down(place) {
    const { kind, task } = this, list = task[kind], at = this.view.from(place);
    if (this.dyads.length && kind === "poses" && task.poses.length === 4 && this.pick(place)) return;
    if (kind === "curve") { task.curve = [at]; this.held = { kind }; this.changed(); return; }
    const tips = kind === "poses" ? task.poses.findIndex((pose) => { const [u, v] = this.tip(pose); return Math.hypot(u - place[0], v - place[1]) < HOLD; }) : -1;
    let index = tips >= 0 ? tips : this.near(list, place);
    const fresh = index < 0;
    if (fresh) {
      if (list.length === KINDS[kind][1]) return;
      list.push(kind === "poses" ? [...at, 0] : at);
      index = list.length - 1;
    }
    this.held = { kind, index, turn: kind === "poses" && (fresh || tips >= 0), fresh, moved: false };
    this.changed();
  }

  move(place) {
    if (!this.held) return;
    const { kind, index, turn } = this.held, at = this.view.from(place);
    if (kind === "curve") {
      const last = this.view.at(this.task.curve[this.task.curve.length - 1]);
      if (Math.hypot(last[0] - place[0], last[1] - place[1]) > 3) this.task.curve.push(at);
    } else {
      const own = this.task[kind][index];
      this.held.moved = true;
      if (turn) { if (norm(minus(at, own)) * this.view.scale > HOLD) own[2] = Math.atan2(at[1] - own[1], at[0] - own[0]); } else [own[0], own[1]] = at;
    }
    this.changed();
  }

  up() {
    const { held } = this;
    this.held = null;
    if (!held) return;
    if (held.kind !== "curve" && !held.fresh && !held.moved) this.task[held.kind].splice(held.index, 1); // a click on what is there takes it away
    this.changed();
    if (held.kind === "curve" && this.enough) this.search();
  }

  /** Take the dyad at a place on Burmester's curves; two of them are a linkage. */
  pick(place) {
    let [best, least] = [null, HOLD];
    for (const dyad of this.dyads) {
      for (const own of [dyad.z, dyad.m].filter(Boolean)) {
        const [u, v] = this.view.at(own), far = Math.hypot(u - place[0], v - place[1]);
        if (far < least) [best, least] = [dyad, far];
      }
    }
    if (!best) return false;
    this.picked = [...this.picked.slice(-1), best];
    if (this.picked.length === 2) {
      const own = linkageOf(this.picked[0], this.picked[1], this.task.poses);
      if (own) { this.put(this.solutionOf(own)); this.take(0); this.picked = []; }
    }
    this.show();
    return true;
  }

  // -- search

  search() {
    if (!this.enough) return;
    this.round += 1;
    const { round } = this;
    this.found = [];
    this.chosen = -1;
    this.begun = performance.now();
    if (this.ofPoses) {
      const { dyads, found, passed } = motionsOf(this.task.poses, this.task.pivots, SHOWN);
      this.dyads = dyads;
      this.waiting = found.map((own) => this.solutionOf(own));
      this.passed = passed;
      this.checked(round);
    } else this.curves(round);
  }

  /** A linkage of poses with its facts, as a thumbnail shows it. */
  solutionOf(own) {
    const { poses } = this.task, { facts } = own;
    const order = poses.map((_, k) => k + 1).sort((a, b) => this.along(facts, a - 1) - this.along(facts, b - 1));
    const drawing = ofPoses(own, poses), size = norm(minus(own.first.z, own.first.m));
    return { drawing, facts, order, own, check: () => { const miss = missOfPoses(drawing, own, poses); return miss === null ? null : miss / size; } };
  }

  along({ turns, sense, full }, k) {
    const turn = (sense || 1) * (turns[k] - turns[0]), whole = 2 * Math.PI;
    return full ? turn - whole * Math.floor(turn / whole + 1e-12) : turn - whole * Math.round(turn / whole);
  }

  put(solution) { this.found = [solution, ...this.found].slice(0, SHOWN); this.verify(solution); }

  verify(solution) {
    const miss = solution.check();
    Object.assign(solution, { miss, good: miss !== null && (this.ofPoses ? miss < TRUE : Math.abs(miss - solution.error) < 0.01) });
  }

  /** Follow one after the other by the page's solver. */
  checked(round) {
    if (round !== this.round) return;
    const solution = this.waiting.shift();
    this.busy = Boolean(solution);
    if (solution) {
      this.found.push(solution);
      this.verify(solution);
      setTimeout(() => this.checked(round), 0);
    }
    if (this.took === null && (!solution || this.found.length === FIRST)) this.took = performance.now() - this.begun;
    this.show();
  }

  /** Compute the atlas while somebody draws. */
  grow() {
    if (this.atlas) return;
    this.atlas = new Atlas();
    const step = () => { if (this.atlas.grow(this.busy ? 0 : SLICE) < 1) setTimeout(step, this.busy ? 50 : 0); };
    step();
  }

  curves(round) {
    this.grow();
    const { task, kind } = this, points = kind === "points" ? task.points : null;
    const wanted = points ? smoothThrough(points) : Float64Array.from(task.curve.flat());
    const search = new Search(this.atlas, wanted, points);
    this.wanted = wanted;
    this.busy = true;
    const step = () => {
      if (round !== this.round) return;
      const more = search.work(SLICE);
      const enough = search.tried > 200 && search.found.length > SHOWN && search.found[5].error < 5e-4;
      if (more && !enough && search.tried < FITS) setTimeout(step, 0);
      else {
        Object.assign(this, { tried: search.tried, fitted: performance.now() - this.begun });
        this.waiting = search.found.map((own) => this.solutionOfCurve(own, search, points)).filter(Boolean)
          .sort((a, b) => a.cost - b.cost).filter((own, k, all) => all.slice(0, k).filter(({ facts }) => facts.class === own.facts.class).length < OF_A_CLASS).slice(0, SHOWN);
        this.checked(round);
      }
    };
    step();
  }

  /** A mechanism that was fitted, as a thumbnail shows it; null of one that does not assemble where its motion begins. */
  solutionOfCurve(own, search, points) {
    const { wanted } = this, drawing = ofCurve(own, points ? own.times[0] : 0.3, search);
    if (!drawing) return null;
    const solution = { drawing, facts: factsOf(own), error: own.error, own, way: search.traced(own, 160), order: points && orderOf(own.times, own.family) };
    const ways = solution.drawing.nodes.map(({ x, y }) => [x, y]).flat(), { angle } = solution.facts;
    solution.cost = Math.max(own.error, 3e-3) * (solution.drawing.links.length > 3 ? 2 : 1) * (1 + extent(Float64Array.from(ways)) / extent(wanted) / 8) * (angle < 0.25 ? 4 : 1);
    solution.check = () => { const run = missOfCurve(own, search, wanted, points); if (run) solution.way = run.way; return run && run.miss; };
    return solution;
  }

  take(index) {
    this.chosen = index;
    this.use(this.found[index].drawing);
    this.show();
  }

  /** What is sought as a problem file. */
  toml() {
    const { task, found, chosen } = this, { drawing } = found[Math.max(0, chosen)] || {};
    if (this.ofPoses) return taskText({ poses: task.poses }, drawing);
    if (this.kind === "points") return taskText({ points: task.points }, drawing);
    const wanted = this.wanted || Float64Array.from(task.curve.flat()), n = wanted.length / 2;
    return taskText({ points: Array.from({ length: 25 }, (_, k) => { const j = Math.round((k * n) / 24) % n; return [wanted[2 * j], wanted[2 * j + 1]]; }), closed: true }, drawing);
  }

  // -- picture

  /** Places [m] of what is sought. */
  get places() { return Object.values(this.task).flat(); }

  /** Draw what is sought above the mechanism. */
  draw(svg) {
    const { layer, view, task, dyads } = this;
    layer.replaceChildren();
    svg.append(layer);
    const line = (places, look, closed = false) => element("path", { d: pathOf(places.map((place) => place && view.at(place)), closed), class: look }, layer);
    if (this.ofPoses && task.poses.length === 4) for (const which of ["z", "m"]) {
      for (const dyad of dyads) if (dyad[which]) { const [cx, cy] = view.at(dyad[which]); if (Math.abs(cx) < 3000 && Math.abs(cy) < 3000) element("circle", { cx, cy, r: 1.3, class: which === "z" ? "circle-points" : "centre-points" }, layer); }
    }
    for (const { z, m } of this.picked || []) for (const own of [z, m].filter(Boolean)) { const [cx, cy] = view.at(own); element("circle", { cx, cy, r: 6, class: "open" }, layer); }
    if (this.ofPoses) {
      task.poses.forEach((pose, k) => this.arrow(pose, k + 1));
      for (const pivot of task.pivots) { const [cx, cy] = view.at(pivot); element("circle", { cx, cy, r: 6, class: "wanted" }, layer); element("path", { d: `M${cx} ${cy}l-7 12h14Z`, class: "wanted" }, layer); }
    } else if (this.kind === "points") {
      task.points.forEach((point, k) => { const [cx, cy] = view.at(point); element("circle", { cx, cy, r: 4, class: "wanted" }, layer); this.number(k + 1, [cx + 9, cy - 9]); });
    } else line(task.curve, "wanted", !this.held);
    const own = this.found[this.chosen];
    if (own && own.way) line(pairs(own.way), "trace", true);
  }

  arrow(pose, k) {
    const [x, y] = this.view.at(pose), [u, v] = this.tip(pose), [c, s] = direction(-pose[2]);
    element("path", { d: `M${x + 14 * s} ${y - 14 * c}L${x} ${y}L${u} ${v}M${u - 8 * c + 4 * s} ${v - 8 * s - 4 * c}L${u} ${v}L${u - 8 * c - 4 * s} ${v - 8 * s + 4 * c}`, class: "wanted" }, this.layer);
    element("circle", { cx: x, cy: y, r: 3.5, class: "wanted" }, this.layer);
    this.number(k, [x - 9, y + 11]);
  }

  number(k, [x, y]) { element("text", { x, y, class: "number" }, this.layer).textContent = String(k); }

  /** Buttons, note and thumbnails as things stand. */
  shown() {
    const { kinds, task, found } = this;
    for (const [kind, button] of Object.entries(kinds)) button.setAttribute("aria-pressed", String(kind === this.kind));
    this.start.disabled = !this.enough;
    this.save.disabled = !this.enough;
    const text = [words(`find_hint_${this.kind}`)];
    if (this.busy) text.push(words("find_busy"));
    else if (this.took !== null && !found.length) text.push(words("find_nothing"));
    else if (found.length) text.push(`${found.length} ${words("find_found")}${this.took === null ? "" : `, ${digits(this.took / 1000, 2)} s`}`);
    if (found.length && this.ofPoses && this.passed && !found[0].facts.branch) text.push(words("find_none"));
    if (found.length && this.ofPoses && task.poses.length === 4) text.push(words("find_pick"));
    this.note.textContent = text.join(". ");
    this.thumbs.replaceChildren(...found.map((own, k) => thumbOf(own, task[this.ofPoses ? "poses" : this.kind], this.ofPoses ? "poses" : this.kind, k === this.chosen, () => this.take(k))));
  }
}

/** The order in which points are met while the driver goes on, from the first. */
function orderOf(times) {
  const whole = 2 * Math.PI, from = (k) => (((times[k] - times[0]) % whole) + whole) % whole;
  const all = Array.from(times, (_, k) => k + 1).sort((a, b) => from(a - 1) - from(b - 1));
  return all[1] > all[all.length - 1] ? [1, ...all.slice(1).reverse()] : all;
}
