/** What is shown: numbers, driver, mode; the poses along the range; undo. No drawing here. */
import { Motion, nearing } from "./path.js";
import { Ghosts } from "./ghosts.js";
import { quantity, rateOf } from "./units.js";
import { unpacked } from "./recorded.js";
import { sentence, words } from "./words.js";
import { aloneOf, FULL_TURN } from "./way.js";

const SAMPLES = 361;
const CHECK = 1e-12, ROUNDING = 2 ** -52, TELLING = 1e5;
const FORCE_CHECK = 1e-9;
const OTHERS = 12;
const PULLS = 4, DAMPING = 1e-6, FURTHEST = 0.3;
const REACTION = { reaction: "N", Fx: "N", Fy: "N", M: "N m", loss: "W" };

/** Whether an entry is the angle of a joint of the plane, which is told without its rates. */
export const bareAngle = ({ kind, names }) => kind === "joints" && names[0] === "angle" && names[1] === "angular_velocity";

/** The function that gives one of the points that pins hold together, the same for all of them. */
export function pinned(joints) {
  const same = new Map(), root = (name) => (same.has(name) ? root(same.get(name)) : name);
  for (const { pin, first, second } of joints) if (pin && root(first) !== root(second)) same.set(root(second), root(first));
  return root;
}

/** The unit quaternion of a rotation given column by column, real part first and not negative. */
export function quaternion([a, d, g, b, e, h, c, f, i]) {
  const squares = [1 + a + e + i, 1 + a - e - i, 1 - a + e - i, 1 - a - e + i];
  const k = squares.indexOf(Math.max(...squares));
  const w = [[squares[0], h - f, c - g, d - b], [h - f, squares[1], b + d, c + g], [c - g, b + d, squares[2], f + h], [d - b, c + g, f + h, squares[3]]][k];
  const size = Math.hypot(...w) * (w[0] < 0 ? -1 : 1);
  return w.map((v) => v / size);
}

/** The vector of the skew part of rate times transposed rotation, both column by column. */
export function spin(rate, turn) {
  const entry = (i, j) => [0, 1, 2].reduce((sum, k) => sum + rate[3 * k + i] * turn[3 * k + j], 0);
  return [[2, 1], [0, 2], [1, 0]].map(([i, j]) => (entry(i, j) - entry(j, i)) / 2);
}

export class Session {
  /** @param {any} data @param {any} code @param {any} [Forces] the class that balances them, in the plane */
  constructor(data, code, Forces) {
    this.data = data;
    this.motion = new Motion(data, code);
    this.theta = data.sliders.map((slider) => slider.value);
    this.s = data.start.s;
    this.mode = (data.modes.find((mode) => mode.own) || { label: "" }).label;
    this.reason = "";
    this.history = [];
    this.future = [];
    this.forces = data.forces && Forces ? new Forces(data, this.motion) : null;
    this.acting = new WeakMap();
    /** The pose shown while curves and ends are still those of the numbers before. */
    this.held = null;
    this.ghosts = new Ghosts(data, code);
    this.follow();
    this.s = this.within(data.start.s) ? data.start.s : this.range[0];
    this.way = this.motion.way;
    this.sample();
  }

  follow() {
    const { way } = this.motion;
    const [low, high] = way.range;
    const around = this.motion.anchor.s;
    this.motion.follow(Math.min(low, around), Math.max(high, around));
    this.range = way.range;
    if (way.whole) {
      // the whole assembled arc: a turn or a stroke beyond on each side, then as far as it goes
      const more = way.turns ? FULL_TURN : 4 * this.data.start.scale;
      if (this.motion.ends[0] === null) this.motion.extend(-1, around - more);
      if (this.motion.ends[1] === null) this.motion.extend(1, around + more);
      this.range = this.motion.round ? [low, low + FULL_TURN] : this.motion.span();
    }
  }

  within(s) { return s >= this.range[0] && s <= this.range[1]; }

  /** The nearest value of the range, or that whole turns away where the driver turns through. */
  inside(s) {
    const [low, high] = this.range, span = high - low;
    return this.motion.round ? low + ((((s - low) % span) + span) % span) : Math.min(Math.max(s, low), high);
  }

  /** Poses along the range, for curves and paths. */
  sample(count = SAMPLES) {
    const [low, high] = this.range;
    this.places = Array.from({ length: count }, (_, k) => (k === count - 1 ? high : low + ((high - low) * k) / (count - 1)));
    this.poses = this.places.map((s) => this.motion.pose(s));
  }

  /**
   * The poses at load against those of Python: the largest difference, 1 for what rounding explains.
   * Near a singular pose rounding of unknowns grows with the condition number, that of their rates
   * with its square. Differences are relative to the pose, to what is usual, or to the mechanism at
   * the driver's pace, in each unit; those of accelerations also to the speeds they come from.
   */
  selfTest() {
    const checks = this.data.checks.map(({ s, y }) => ({ pose: this.motion.pose(s), y: y.map(unpacked) }));
    const { entries, start } = this.data;
    const { pace } = this.data;
    let worst = 0;
    for (const unit of new Set(entries.map((entry) => entry.unit))) {
      const own = entries.filter((entry) => entry.unit === unit);
      for (let order = 0; checks.length && order < checks[0].y.length; order += 1) {
        const size = (y) => Math.max(...own.flatMap(({ columns }) => columns.map((i) => Math.abs(y[i]))));
        const sizes = checks.map(({ y }) => Math.max(size(y[order]), order > 1 ? pace * size(y[1]) : 0));
        const usual = [...sizes].sort((a, b) => a - b)[sizes.length >> 1];
        checks.forEach(({ pose, y }, k) => {
          const natural = (unit === "m" ? start.scale : 1) * pace ** order;
          const allowed = (CHECK + ROUNDING * this.motion.condition(pose) ** 2) * Math.max(sizes[k], usual, natural, 1e-300);
          for (const { columns } of own) {
            const found = this.inTime(pose, columns, order);
            // rates that are none where Python has some
            worst = Math.max(worst, ...columns.map((i, j) => (found ? Math.abs(found[j] - y[order][i]) / allowed : Infinity)));
          }
        });
      }
    }
    return worst;
  }

  /** Whether the page finds what Python found, at a pose at least that tells. */
  get trusted() {
    const telling = this.data.checks.some(({ s }) => this.motion.condition(this.motion.pose(s)) < TELLING);
    return telling && this.selfTest() <= 1;
  }

  get pose() { return this.held || this.motion.pose(this.s); }

  /** Poses are solved here; what is led along is told as it is. */
  get live() { return true; }
  get value() { return this.s; }
  get step() { return (this.range[1] - this.range[0]) / 360; }
  at(s) { return s; }

  /** Lead the pose on for some seconds, at the driver's pace where that can be watched; back at an end. */
  advance(seconds) {
    const [low, high] = this.range, { pace } = this.motion.way, { round } = this.motion;
    const rate = Math.abs(pace) > 0 ? Math.min(Math.abs(pace), (high - low) / 1.5) : (high - low) / 6;
    const s = this.s + seconds * rate * (this.sense || 1) * (round ? Math.sign(pace || 1) : 1);
    if (!round && !this.within(s)) this.sense = s > high ? -1 : 1;
    this.drive(this.inside(s));
  }

  moving(columns) {
    const { poses } = this;
    if (this.sampled !== poses) {
      const there = poses.filter((pose) => pose.y);
      this.sampled = poses;
      this.two = [there[0], there[Math.floor(there.length / 3)]];
    }
    const [a, b] = this.two;
    return a && b && columns.some((k) => Math.abs(a.y[0][k] - b.y[0][k]) > 1e-12 * Math.max(1, Math.abs(a.y[0][k])));
  }

  /** Where a point is in all poses, null where there is none; undefined of one that stands still. */
  track(name) {
    const { columns } = this.data.entries.find(({ kind, part }) => kind === "points" && part === name) || {};
    return columns && this.moving(columns) ? this.poses.map((pose) => (pose.y ? columns.map((k) => pose.y[0][k]) : null)) : undefined;
  }

  /** Use the numbers shown for what symbols are drawn by: axes, radii, curves. */
  look(scene) {
    const { kernels, p } = this.motion;
    const numbers = kernels.looks.run(p)[0];
    const joints = Object.fromEntries(scene.joints.map((joint) => [joint.name, joint]));
    this.data.kernels.looks_at.forEach(([name, key], k) => { joints[name][key] = key === "radius" ? Math.abs(numbers[k]) : numbers[k]; });
    const curved = scene.joints.filter((joint) => joint.curve);
    if (!curved.length) return;
    const last = curved[0].curve.length - 1;
    for (let i = 0; i <= last; i += 1) {
      const places = kernels.curves.run([i / last], p)[0];
      curved.forEach((joint, k) => { joint.curve[i] = [places[2 * k], places[2 * k + 1]]; });
    }
  }

  /** Where the points are: name to place. */
  places_of(pose) {
    const places = {};
    const width = this.data.scene.dimension;
    this.data.scene.ground.forEach((name, k) => { places[name] = Array.from(this.motion.ground.slice(width * k, width * (k + 1))); });
    if (!pose || !pose.y) return places;
    for (const { kind, part, columns } of this.data.entries) {
      if (kind !== "points") continue;
      places[part] = columns.map((k) => pose.y[0][k]);
    }
    return places;
  }

  /** Angles of bodies; in space their rotations, column by column. */
  angles_of(pose) {
    const angles = {};
    if (!pose || !pose.y) return angles;
    for (const { kind, part, columns } of this.data.entries) if (kind === "bodies") angles[part] = columns.length > 1 ? columns.map((k) => pose.y[0][k]) : pose.y[0][columns[0]];
    return angles;
  }

  /** Outputs of a pose or their rates in time; null without any. */
  inTime(pose, columns, order) {
    return pose && pose.y && (order === 0 || Number.isFinite(pose.y[1][columns[0]])) ? this.motion.inTime(pose, columns, order) : null;
  }

  /** What an entry tells at a pose: of a rotation the quaternion and the vectors of its rates. */
  told(pose, entry, order) {
    const found = this.inTime(pose, entry.columns, order);
    if (!found || entry.names[0] !== "orientation") return found;
    const turn = this.inTime(pose, entry.columns, 0);
    if (order === 0) return quaternion(turn);
    const first = this.inTime(pose, entry.columns, 1);
    return order === 1 ? spin(first, turn) : spin(found, turn);
  }

  /** What acts at a pose, null without forces; computed once. */
  forcesAt(pose) {
    if (!this.forces || !pose) return null;
    if (!this.acting.has(pose)) this.acting.set(pose, this.forces.at(pose));
    return this.acting.get(pose);
  }

  /** Whether what Python computed of forces is found again; else they are left out. */
  checkForces() {
    if (this.forces && !(this.forces.selfTest() <= FORCE_CHECK)) this.forces = null;
    return Boolean(this.forces);
  }

  /** An output by its path, as points/rod.B/velocity: its unit, its numbers and one scalar at a pose. */
  output(path) {
    const [kind, part, name, axis] = path.split("/");
    const forced = (unit, valuesOf) => {
      const of = (pose) => { const found = this.forcesAt(pose); return found && found.status !== "jammed" ? valuesOf(found) : null; };
      return { unit, of, scalar: (pose) => { const own = of(pose); return own ? (own.length > 1 ? Math.hypot(own[0], own[1]) : own[0]) : null; } };
    };
    if (this.forces && kind === "efforts" && this.data.forces.efforts.includes(part)) return forced(this.data.forces.units[part], ({ efforts }) => [efforts[part]]);
    if (this.forces && kind === "joints" && REACTION[name] && this.data.forces.joints.some((own) => own.name === part)) {
      const k = ["Fx", "Fy", "M"].indexOf(name);
      return forced(REACTION[name], ({ losses, reactions: { [part]: all } }) => (name === "loss" ? [losses[part] ?? 0] : k < 0 ? all : [all[k]]));
    }
    const entry = this.data.entries.find((own) => own.kind === kind && own.part === part && own.names.includes(name));
    if (!entry) throw new Error(`no output ${path}`);
    const order = entry.names.indexOf(name);
    const of = (pose) => this.told(pose, entry, order);
    const scalar = (pose) => {
      const found = of(pose);
      if (!found) return null;
      if (found.length === 1) return found[0];
      return axis ? found["xyz".indexOf(axis)] : Math.hypot(...found);
    };
    return { unit: rateOf(entry.unit, order), of, scalar, whole: !axis };
  }

  // -- changes

  /** A change begins: what is shown can be restored once something differs from it. */
  remember() {
    this.settle();
    this.begun = this.now();
  }

  /** Something differs from what was shown when the change began. */
  changed() {
    if (!this.begun) return;
    this.history.push(this.begun);
    if (this.history.length > 200) this.history.shift();
    this.future = [];
    this.begun = null;
  }

  /** Why no mechanism has such numbers: a negative radius, a length of nothing; "" for others. */
  refusal(theta) {
    const k = theta.findIndex((value, i) => this.data.sliders[i].refuses.includes(value < 0 ? "-" : value === 0 ? "0" : "+"));
    return k < 0 ? "" : sentence("refused", this.data.sliders[k].name, quantity(theta[k], this.data.units[this.data.sliders[k].name] || "m"));
  }

  /** What can be restored. */
  now() {
    const { anchor, way, sizeX, sizeU } = this.motion;
    return { theta: [...this.theta], s: this.s, mode: this.mode, motion: { anchor, way, sizeX: sizeX.slice(), sizeU: sizeU.slice() } };
  }

  restore({ theta, s, mode, motion }) {
    Object.assign(this.motion, motion);
    Object.assign(this, { theta, mode });
    this.motion.setNumbers(theta);
    this.follow();
    this.s = s;
    this.sample();
  }

  undo(back = true) {
    this.settle();
    this.begun = null;
    const [from, to] = back ? [this.history, this.future] : [this.future, this.history];
    if (!from.length) return false;
    to.push(this.now());
    this.restore(from.pop());
    return true;
  }

  /** Drive to a value; false where there is no pose, which is shown as such. */
  drive(s) {
    this.settle();
    this.s = s;
    const ok = this.pose.status !== "unassembled";
    this.reason = ok ? "" : this.opening(s);
    return ok;
  }

  opening(s) {
    const [low, high] = this.motion.ends;
    const end = s > (high ? high.s : Infinity) ? high : s < (low ? low.s : -Infinity) ? low : high || low;
    const happens = end && { limit: "opens", pole: "grows" }[end.kind];
    return end ? `${end.group} ${words(happens || "stops")} ${end.joint}` : "";
  }

  /**
   * Carry the pose shown alone to other values of dimensions; false where that is not proved.
   * What is told of the whole range follows with `settle`.
   */
  hurry(theta) {
    const { pose, motion } = this;
    if (pose.status !== "ok" || this.refusal(theta)) return false;
    const from = [...this.theta];
    const found = motion.carry(pose, from, theta);
    const now = found.t === 1 ? motion.solved(pose.s, pose.place, found.x) : null;
    const known = now && now.status === "ok" && now.x.every((value, i) => Math.abs(value) <= motion.sizeX[i]);
    if (!known) {
      motion.setNumbers(from);
      motion.sign = Float64Array.from(pose.det, Math.sign);
      return false;
    }
    this.held = now;
    this.changed();
    this.theta = [...theta];
    this.reason = "";
    return true;
  }

  /** Follow the path of the pose that was carried. */
  settle() {
    if (!this.held) return;
    const { x, place } = this.held;
    this.held = null;
    this.goOn(x, place);
  }

  /** Follow the path of a pose, as near as that leads to the driver's value. */
  goOn(x, place) {
    this.motion.anchor = this.nearZero({ x: Float64Array.from(x), s: place });
    this.follow();
    if (!this.within(this.s)) this.s = Math.min(Math.max(this.s, this.range[0]), this.range[1]);
    this.sample();
  }

  /** Use other values of dimensions, on the branch that is followed there; how far it came, 0 to 1. */
  dimension(theta) {
    this.settle();
    this.reason = this.refusal(theta);
    if (this.reason) return 0;
    const from = [...this.theta];
    const before = this.now();
    let pose = this.pose;
    if (pose.status !== "ok") pose = this.poses.find((other) => other.status === "ok");
    if (!pose) return 0;
    const candidates = [pose];
    const others = this.poses.filter((other) => other.status === "ok");
    for (let k = 0; k < OTHERS && others.length; k += 1) candidates.push(others[Math.floor((k * (others.length - 1)) / (OTHERS - 1))]);
    const sign = [...this.motion.sign];
    let best = { t: -1, x: null, pose };
    for (const candidate of candidates) {
      this.motion.sign = Float64Array.from(sign);
      const found = this.motion.carry(candidate, from, theta);
      if (found.t > best.t) best = { ...found, pose: candidate, opened: this.motion.opened };
      if (best.t === 1) break;
    }
    const reached = from.map((value, i) => (best.t === 1 ? theta[i] : value + best.t * (theta[i] - value)));
    this.theta = reached;
    this.motion.setNumbers(reached);
    this.goOn(best.x, best.pose.place);
    this.reason = "";
    const lost = this.pose.status !== "ok" && !this.poses.some((other) => other.status === "ok");
    if (lost) {
      // a pose between two limit positions that nothing is proved from
      best = { ...best, t: 0, opened: best.opened ?? 0 };
      this.restore(before);
    } else if (best.t > 0) this.changed();
    if (best.t < 1) {
      const block = this.data.start.blocks[best.opened];
      this.reason = block ? `${block.group} ${words("opens")} ${block.joint}` : words("unreal");
    }
    return best.t;
  }

  /** The same pose with the driver whole turns nearer to the file's range, if that is the same pose. */
  nearZero(anchor) {
    const { data, motion } = this;
    if (data.drivers) return anchor;
    const middle = (data.range[0] + data.range[1]) / 2;
    const turns = data.start.turns ? Math.round((anchor.s - middle) / FULL_TURN) : 0;
    if (turns === 0) return anchor;
    const s = anchor.s - FULL_TURN * turns;
    const found = motion.solved(s, s, anchor.x);
    const same = found.status === "ok" && found.x.every((value, i) => Math.abs(value - anchor.x[i]) < 1e-9 * (1 + Math.abs(value)));
    return same ? { x: found.x, s } : anchor;
  }

  // -- several drivers

  /** Values of the drivers in the pose shown. */
  drivers() {
    const { held, motion, s } = this;
    return Array.from(motion.way.u(held ? held.place : motion.placeOf(s) ?? s));
  }

  /** The pose shown, or at a limit position and where there is none the nearest one of the way. */
  get near() {
    const { pose, poses, s } = this;
    if (pose.status === "ok") return pose;
    return poses.filter((other) => other.status === "ok").reduce((best, other) => (Math.abs(other.s - s) < Math.abs(best.s - s) ? other : best), { ...pose, s: Infinity });
  }

  /** Lead the pose shown along one of several drivers, or (-1) along the file's way. */
  along(k) {
    this.settle();
    const { data, motion, near: pose } = this;
    if ((k < 0 ? this.way : data.drivers[k].name) === (k < 0 ? motion.way : motion.way.name)) return true;
    if (pose.status !== "ok") { this.reason = words("unassembled"); return false; }
    const before = this.now();
    motion.anchor = { x: pose.x, s: pose.place };
    if (k >= 0) this.lead(Array.from(motion.way.u(pose.place)), pose.x, k);
    else {
      const begin = data.start.s;
      const there = motion.straightTo(this.way.u(begin));
      if (there.t < 1) { this.restore(before); this.reason = this.ended(there.end); return false; }
      motion.turnTo(this.way, there.x, begin);
      this.s = begin;
      this.follow();
      this.sample();
    }
    this.reason = "";
    return true;
  }

  /** Lead a pose along one of several drivers from values u. */
  lead(u, x, k) {
    this.motion.turnTo(aloneOf(this.data, u, k), x, u[k]);
    this.s = u[k];
    this.follow();
    this.sample();
  }

  ended(end) { return end ? `${end.group} ${words(end.kind === "limit" ? "opens" : "stops")} ${end.joint}` : words("unassembled"); }

  /** Move several drivers straight to other values; how far they came, 0 to 1. */
  move(u, k = 0) {
    this.settle();
    const { motion, near: pose } = this;
    if (pose.status !== "ok") { this.reason = words("unassembled"); return 0; }
    motion.anchor = { x: pose.x, s: pose.place };
    const there = motion.straightTo(u);
    this.lead(there.u, there.x, k);
    this.reason = there.t < 1 ? this.ended(there.end) : "";
    return there.t;
  }

  /**
   * Move several drivers so that a point comes nearer to a place of the picture: Gauss-Newton, each step a
   * proved straight line. What is told of the whole way follows with `settle`.
   */
  reach(columns, [x, y], flat) {
    const { motion, data } = this;
    const k = Math.max(0, data.drivers.findIndex(({ name }) => name === motion.way.name));
    let { near: pose } = this;
    if (pose.status !== "ok") return false;
    for (let round = 0; round < PULLS; round += 1) {
      const u = Array.from(motion.way.u(pose.place));
      const here = flat(columns.map((i) => pose.y[0][i]));
      const gap = [x - here[0], y - here[1]];
      const slopes = data.drivers.map(({ size }, i) => flat(motion.slopesBy(pose.x, u, i, columns)).map((value) => value * size));
      const change = nearing(slopes, gap, DAMPING * slopes.flat().reduce((sum, value) => sum + value * value, 0));
      if (!change) break;
      const most = Math.max(...change.map(Math.abs));
      if (!Number.isFinite(most) || most < 1e-9) break;
      const share = Math.min(1, FURTHEST / most);
      motion.anchor = { x: pose.x, s: pose.place };
      const there = motion.straightTo(u.map((value, i) => value + share * change[i] * data.drivers[i].size));
      motion.turnTo(aloneOf(data, there.u, k), there.x, there.u[k]);
      const found = motion.solved(there.u[k], there.u[k], there.x);
      if (found.status !== "ok") break;
      pose = found;
      if (there.t < 1) { this.reason = this.ended(there.end); break; }
      this.reason = "";
    }
    motion.turnTo(aloneOf(data, Array.from(motion.way.u(pose.place)), k), pose.x, pose.place);
    this.changed();
    this.held = pose;
    this.s = pose.place;
    return true;
  }

  /** Go over to another assembly mode that Python found at the start. */
  choose(label) {
    this.settle();
    const mode = this.data.modes.find((own) => own.label === label);
    if (!mode) { this.reason = `${words("nomode")} ${label}`; return false; }
    const before = this.now();
    const now = [...this.theta];
    const { motion, motion: { way } } = this, shown = this.drivers(), failed = motion.begin(mode, now, this.way);
    if (failed || (way !== this.way && !motion.aside(way, shown))) { // there with the drivers as they are
      this.restore(before);
      this.reason = failed === "unassembled" ? words(failed) : `${label} ${words("fades")}`;
      return false;
    }
    this.changed();
    this.theta = now;
    this.mode = label;
    this.follow();
    if (!this.within(this.s)) this.s = this.range[0];
    this.sample();
    this.reason = "";
    return true;
  }
}
