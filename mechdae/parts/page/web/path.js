/** A certified path of the mechanism along its driver: the tests are those of mechdae's own paths. */
import { Kernel } from "./kernel.js";
import { FULL_TURN, straightOf, wayOf } from "./way.js";
import { dot } from "./vectors.js";

const ROUND = 2 ** -53;
const H_LIMIT = 0.2;
const TINY = 1e-17;
const ROUNDS = 8;
const APPROACH = 1e-6, SMALLEST = 1e-9;
const TRIES = 20000;
const RETURN = 1e-8;
const SLOWER = 1.25;
const ROUGH = 0.5, AHEAD = 1024, SETTLED = 1e-9;

/** A copy as a plain array: short ones are made five times faster than typed ones. @param {ArrayLike<number>} part */
function copied(part) {
  const own = new Array(part.length);
  for (let i = 0; i < part.length; i += 1) own[i] = part[i];
  return own;
}

/** Rows of a square matrix that is given column by column. */
function rowsOf(columns, size) {
  const rows = new Array(size);
  for (let i = 0; i < size; i += 1) {
    rows[i] = new Array(size);
    for (let j = 0; j < size; j += 1) rows[i][j] = columns[i + size * j];
  }
  return rows;
}

/** Bring a small dense matrix to triangular form in place, rows exchanged, its right side with it; the sign of its determinant, NaN where it is singular. */
function triangular(matrix, right) {
  const n = matrix.length;
  let sign = 1;
  for (let k = 0; k < n; k += 1) {
    let best = k;
    for (let i = k + 1; i < n; i += 1) if (Math.abs(matrix[i][k]) > Math.abs(matrix[best][k])) best = i;
    if (!(Math.abs(matrix[best][k]) > 0)) return NaN;
    if (best !== k) {
      [matrix[k], matrix[best]] = [matrix[best], matrix[k]];
      [right[k], right[best]] = [right[best], right[k]];
      sign = -sign;
    }
    sign *= Math.sign(matrix[k][k]);
    for (let i = k + 1; i < n; i += 1) {
      const share = matrix[i][k] / matrix[k][k];
      if (share !== 0) {
        for (let j = k; j < n; j += 1) matrix[i][j] -= share * matrix[k][j];
        right[i] -= share * right[k];
      }
    }
  }
  return sign;
}

/** Solve a small dense system in place; null where it is singular. */
export function eliminated(matrix, right) {
  if (Number.isNaN(triangular(matrix, right))) return null;
  for (let k = right.length - 1; k >= 0; k -= 1) {
    for (let j = k + 1; j < right.length; j += 1) right[k] -= matrix[k][j] * right[j];
    right[k] /= matrix[k][k];
  }
  return right;
}

/** The changes whose effects, column by column, come nearest to a gap, damped; null where nothing has an effect. */
export function nearing(columns, gap, damping) {
  return eliminated(columns.map((one, i) => columns.map((two, j) => dot(one, two) + (i === j ? damping : 0))), columns.map((one) => dot(one, gap)));
}

/** Sign of the determinant of a small matrix, which is overwritten. */
export const signOf = (matrix) => triangular(matrix, []);

/** Kernels and numbers of one mechanism; `solve` follows its path. */
export class Motion {
  /** @param {any} data @param {any} code printed functions by name */
  constructor(data, code) {
    this.data = data;
    this.start = data.start;
    const layout = data.kernels;
    this.kernels = Object.fromEntries(
      Object.keys(layout).filter((name) => code[name]).map((name) => [name, new Kernel(code[name], layout[name])]));
    this.n = this.start.nx;
    this.nb = this.start.nb;
    this.sizeX = Float64Array.from(this.start.size_x);
    this.sizeU = Float64Array.from(this.start.size_u);
    this.nu = this.start.nu;
    this.way = wayOf(data, this.kernels);
    this.anchor = { x: Float64Array.from(this.start.x), s: this.start.s };
    this.nodes = [];
    this.ends = [null, null];
    /** The block that stopped Newton's method last, -1 where numbers were not real. */
    this.opened = 0;
    this.setNumbers(data.sliders.map(({ value }) => value));
  }

  /** Use other values of the sliders: parameters and bounds, no pose. */
  setNumbers(theta) {
    // what is far grows with the mechanism
    const grown = this.data.sliders.map(({ value }, k) => Math.abs(theta[k] / (value || this.start.scale)));
    this.far = this.start.far.map((value) => (value === null ? Infinity : value * Math.max(1, ...grown)));
    this.p = Float64Array.from(this.kernels.numbers.run(theta)[0]);
    this.ground = Float64Array.from(this.kernels.ground.run(this.p)[0]);
    this.bounds();
  }

  /** Bounds for the sizes that the path may have; those of the outputs when they are read. */
  bounds() {
    this.floors = this.leastDivisors();
    const [kappa, rho, mu] = this.overBoxes("constants", [this.sizeX, this.sizeU, this.p, [this.start.scale], this.floors], Math.max);
    const { length } = this.p;
    const { n, nb, nu } = this;
    this.whole = new Float64Array(length + 1 + 2 * nb + n + this.floors.length + 2 * nu);
    this.whole.set(this.p);
    this.whole[length] = this.start.scale;
    this.whole.set(kappa, length + 1);
    this.whole.set(rho, length + 1 + nb);
    for (let i = 0; i < n; i += 1) this.whole[length + 1 + 2 * nb + i] = ROUND * this.sizeX[i];
    this.whole.set(this.floors, length + 1 + 2 * nb + n);
    this.consts = this.whole.subarray(0, this.whole.length - 2 * nu);
    this.lead(0);
    this.kappa = this.whole.subarray(length + 1, length + 1 + nb);
    this.mu = Float64Array.from(mu);
    this.slopes = null;
  }

  /** Lead the path along another way, of which `s` is the place of the pose `x`. */
  turnTo(way, x, s) {
    this.way = way;
    this.anchor = { x: Float64Array.from(x), s };
    this.lead(0);
  }

  /** Use the line of a leg of the way: u = u0 + s d. */
  lead(leg) {
    this.leg = leg;
    this.whole.set(this.way.lineOf(leg), this.consts.length);
  }

  /** Largest or least results of a function over all parts of the curves that touch; once without any. */
  overBoxes(name, given, chosen) {
    const kernel = this.kernels[name], { boxes } = this.start;
    if (!boxes) return kernel.run(...given);
    let found = null;
    boxes[0].forEach((low, k) => {
      const own = kernel.run(...given, low, boxes[1][k]);
      found = own.map((part, i) => (found ? part.map((value, j) => chosen(value, found[i][j])) : part.slice()));
    });
    return found;
  }

  /** What curves divide by is at least that anywhere; nothing is proved where it may vanish. */
  leastDivisors() {
    const floors = new Float64Array(this.start.floors);
    if (floors.length) {
      const [least] = this.overBoxes("least", [this.sizeX, this.sizeU, this.p], Math.min);
      floors.set(least.every((value) => value > 0) ? least : least.map(() => NaN));
    }
    return floors;
  }

  /** The pose function at values of the drivers that belong to a place. */
  posed(x, place) {
    if (!this.data.drivers) return this.kernels.pose.run(x, [place], this.consts);
    return this.posedAt(x, this.way.u(place), this.way.rates(place));
  }

  /** The same of several drivers with rates of theirs. */
  posedAt(x, u, rates) { return this.kernels.pose.run(x, u, ...rates.slice(0, this.kernels.pose.inputs.length - 3), this.consts); }

  /** Derivatives of some outputs by one of several drivers. */
  slopesBy(x, u, k, columns) {
    const still = u.map(() => 0);
    const [, , , , , , first] = this.posedAt(x, u, [still.map((_, i) => (i === k ? 1 : 0)), still, still]);
    return columns.map((i) => first[i]);
  }

  /** Lead the anchor straight to other values of several drivers: how far it came, the values and unknowns there, what ended it. */
  straightTo(to) {
    const { x, s } = this.anchor;
    const from = Array.from(this.way.u(s));
    if (from.every((value, k) => value === to[k])) return { t: 1, u: from, x, end: null };
    this.turnTo(straightOf(this.data, from, to), x, 0);
    if (!this.follow(0, 1)) return { t: 0, u: from, x, end: null };
    const last = this.nodes[this.nodes.length - 1];
    const t = this.ends[1] ? last.s : 1;
    return { t, u: t === 1 ? [...to] : this.way.u(t), x: last.state.slice(0, this.n), end: this.ends[1] };
  }

  /** Whether the driver turns through. */
  get round() { return this.way.turns && this.ends.every((end) => end === null); }

  /** Outputs or their rates in time: those by the driver times its speed. */
  inTime({ y: [y, first, second] }, columns, order) {
    const { speed, acceleration, drivers } = this.data;
    if (order === 0) return columns.map((k) => y[k]);
    if (drivers) return columns.map((k) => (order === 1 ? first : second)[k]); // in time as they are
    return columns.map((k) => (order === 1 ? first[k] * speed : second[k] * speed * speed + first[k] * acceleration));
  }

  /** Condition number of the worst block at a pose, 1 at least. */
  condition({ beta }) { return beta ? beta.reduce((worst, value, b) => Math.max(worst, this.mu[b] * value), 1) : 1; }

  outputSlopes() {
    if (!this.slopes) {
      const found = this.overBoxes("slopes", [this.sizeX, this.sizeU, this.p, this.floors], Math.max);
      this.slopes = Float64Array.from(found[0]);
      this.rounding = Float64Array.from(found[1]);
    }
    return this.slopes;
  }

  /** One step: [state, test, det, miss], overwritten by the next one. */
  step(state, s, ds) {
    const kernel = this.kernels[`${this.way.prefix}advance`];
    kernel.inputs[1][0] = s;
    kernel.inputs[1][1] = ds;
    kernel.inputs[0].set(state);
    kernel.inputs[2].set(this.whole);
    kernel.code(kernel.memory);
    return kernel.outputs;
  }

  proved(after, test, det, miss) {
    const failed = [];
    for (let b = 0; b < this.nb; b += 1) {
      const inside = this.start.blocks[b].own.every((i) => Math.abs(after[i]) <= this.far[i]);
      if (!(test[b] <= 1 && miss[b] <= 1 && Math.sign(det[b]) === this.sign[b] && inside)) failed.push(b);
    }
    return failed;
  }

  /** Follow the path from the anchor over a range; true unless the anchor is no pose. */
  follow(low, high) {
    for (let grown = 0; grown < 8; grown += 1) {
      const blank = new Float64Array(3 * this.n + this.nb);
      blank.set(this.anchor.x);
      this.lead(this.way.legAt(this.anchor.s, 1));
      const [state, , det] = this.step(blank, this.anchor.s, 0);
      if (!state.every(Number.isFinite)) return false;
      this.sign = Float64Array.from(det, Math.sign);
      this.nodes = [{ s: this.anchor.s, state: Float64Array.from(state) }];
      this.ends = [null, null];
      this.extend(1, high);
      this.extend(-1, low);
      if (this.way.turns && (this.ends[0] === null) !== (this.ends[1] === null)) {
        // what the driver does not reach directly it may reach the other way round
        if (this.ends[0] === null) this.extend(-1, this.ends[1].s - FULL_TURN);
        else this.extend(1, this.ends[0].s + FULL_TURN);
      }
      if (!this.grow()) return true;
      this.bounds();
    }
    return true;
  }

  /** Enlarge the sizes that the bounds hold for, where the path went further. */
  grow() {
    let further = false;
    for (const { s, state } of this.nodes) {
      for (let i = 0; i < this.n; i += 1) {
        if (Math.abs(state[i]) > this.sizeX[i]) {
          this.sizeX[i] = 1.5 * Math.abs(state[i]);
          further = true;
        }
      }
      this.way.u(s).forEach((value, k) => {
        if (Math.abs(value) <= this.sizeU[k] || this.way.kernel) return; // a law is known where it leads
        this.sizeU[k] = 1.5 * Math.abs(value);
        further = true;
      });
    }
    return further;
  }

  /** Follow the path in one sense as far as a place, or to its end. */
  extend(sense, to) {
    if (this.ends[sense > 0 ? 1 : 0] !== null) return;
    const { nodes } = this;
    const edge = sense > 0 ? nodes.slice(-2) : nodes.slice(0, 2).reverse();
    const known = edge.length;
    for (;;) {
      const last = edge[edge.length - 1];
      if (sense * (to - last.s) <= 0) break;
      const leg = this.way.legAt(last.s, sense);
      if (leg !== this.leg) this.turned(edge, leg);
      const stop = this.way.end(leg, sense, to);
      this.grown(edge, sense, stop);
      if (stop === to || this.ends[sense > 0 ? 1 : 0] !== null) break;
    }
    const added = edge.slice(known);
    this.nodes = sense > 0 ? nodes.concat(added) : added.reverse().concat(nodes);
  }

  /** Go over to another leg at a corner: the same pose with the rates of the new direction. */
  turned(list, leg) {
    const last = list[list.length - 1];
    this.lead(leg);
    list.push({ s: last.s, state: this.step(last.state, last.s, 0)[0].slice() });
  }

  /** Add nodes to the last ones of a path, as far as a place or to its end, which is noted. */
  grown(list, sense, to) {
    const largest = this.way.largest(this.leg);
    const side = sense > 0 ? 1 : 0;
    let step = largest;
    let look = APPROACH * largest; // the step below which a limit position is looked for
    for (let tries = 0, most = this.start.most ?? Math.max(TRIES, this.start.tries); ; tries += 1) {
      const last = list[list.length - 1];
      const rest = sense * (to - last.s);
      if (rest <= 1e-12 * largest) return;
      const ds = Math.min(step, rest);
      const place = ds === rest ? to : last.s + sense * ds;
      const [after, test, det, miss] = this.step(last.state, last.s, place - last.s);
      const failed = this.proved(after, test, det, miss);
      if (failed.length === 0) {
        list.push({ s: place, state: after.slice() });
        step = Math.min(1.5 * step, largest);
        look = Math.max(look, Math.min(step, APPROACH * largest));
        continue;
      }
      step = ds / 2;
      if (step < look) {
        look = step / 4;
        this.ends[side] = this.limit(last, list[list.length - 2], failed, sense, AHEAD * step);
      }
      if (this.ends[side] === null && (step < SMALLEST * largest || tries > most)) this.ends[side] = this.stop(last, failed[0]);
      if (this.ends[side] !== null) return;
    }
  }

  /** The end of a path at a node beyond which nothing is proved: where unknowns grow without bound a pole. */
  stop(node, b) {
    const { own, group, joint } = this.start.blocks[b];
    const kind = own.some((i) => Math.abs(node.state[i]) > this.far[i] / 2) ? "pole" : "unproved";
    return { s: node.s, x: node.state.slice(0, this.n), group, joint, kind };
  }

  /** The limit position at most `far` ahead of a node, null without any: Newton on {F = 0, J v = 0, v.v = 1}. */
  limit(node, before, failed, sense, far) {
    let found = null;
    const { blocks } = this.start;
    const inside = (b) => failed.some((other) => blocks[b].own.every((i) => blocks[other].chain.includes(i)));
    for (const b of [...blocks.keys()].filter(inside)) {
      const { own, chain, group, joint } = blocks[b];
      const w = this.start.weights;
      const speed = own.map((i) => node.state[this.n + i] / w[i]);
      const length = Math.hypot(...speed);
      if (!(length > 0)) continue;
      const y = [...chain.map((i) => node.state[i]), node.s, ...speed.map((v) => v / length)];
      const kernel = this.kernels[`${this.way.prefix}fold${b}`];
      let small = false;
      for (let k = 0; k < 30 && !small; k += 1) {
        const [G, Gy] = kernel.run(y, this.whole);
        const size = y.length;
        const change = eliminated(rowsOf(Gy, size), copied(G));
        if (change === null) break;
        let moved = 0, most = 0;
        for (let i = 0; i < size; i += 1) {
          y[i] -= change[i];
          moved = Math.max(moved, Math.abs(change[i]));
          most = Math.max(most, Math.abs(y[i]));
        }
        if (!Number.isFinite(moved)) break;
        small = moved < 1e-13 * (1 + most);
      }
      const s = y[chain.length];
      const ahead = sense * (s - node.s);
      if (!small || ahead < -1e-9 || ahead > far || this.way.end(this.leg, sense, s) !== s) continue;
      if (found && Math.abs(found.s - node.s) <= Math.abs(ahead)) continue;
      const offset = own.map((i) => (node.state[i] - y[chain.indexOf(i)]) / w[i]);
      const beside = offset.map((value, k) => value - 2 * (node.s - s) * speed[k]); // x - x* goes with the root of s - s*
      if (!(Math.hypot(...beside) <= ROUGH * Math.hypot(...offset))) continue; // another fold than that of the path
      const x = this.ahead(s, sense, node, before);
      chain.forEach((i, k) => { x[i] = y[k]; });
      if (!this.closes(x, s, new Set(chain), node)) continue; // another group has opened before
      found = { s, x, group, joint, kind: "limit" };
    }
    return found;
  }

  /** Solve for the unknowns that are not given, block by block; whether they close as on the path, at a node of it. */
  closes(x, s, given, node) {
    const others = [...this.start.blocks.keys()].filter((b) => !given.has(this.start.blocks[b].own[0]));
    for (const b of others) if (!this.closed(b, x, s)) return false;
    return others.every((b) => this.side(b, x, s) === this.side(b, node.state, node.s));
  }

  /** Sign of the determinant of one block at unknowns as they are: a step of the pose function would leave a limit position far away. */
  side(b, x, s) {
    const { own, chain } = this.start.blocks[b];
    const [, , J] = this.kernels[`${this.way.prefix}fold${b}`].run([...chain.map((i) => x[i]), s, ...own.map(() => 0)], this.whole);
    return signOf(rowsOf(J, own.length));
  }

  /** Newton's method on one block, those before it held: the first rows of what its limit positions are found by. */
  closed(b, x, s) {
    const { own, chain } = this.start.blocks[b];
    const first = chain.length - own.length; // its own come last
    for (let round = 0; round < ROUNDS; round += 1) {
      const y = [...chain.map((i) => x[i]), s, ...own.map(() => 0)];
      const [G, Gy] = this.kernels[`${this.way.prefix}fold${b}`].run(y, this.whole);
      const matrix = own.map((_, i) => own.map((__, j) => Gy[first + i + y.length * (first + j)]));
      const change = eliminated(matrix, own.map((_, i) => G[first + i]));
      if (!change || !change.every(Number.isFinite)) return false;
      let moved = 0;
      own.forEach((i, k) => {
        moved = Math.max(moved, Math.abs(change[k]) / (1 + Math.abs(x[i])));
        x[i] -= change[k];
      });
      if (moved > 1) return false;
      if (moved < SETTLED) return true;
    }
    return false;
  }

  /** Unknowns at a limit position ahead of a path's last two nodes (the second may be missing): cubic pieces in the root of what is left. */
  ahead(s, sense, one, two) {
    const { n } = this;
    const x = one.state.slice(0, n);
    if (!two || two.s === one.s) return x.map((value, i) => value + one.state[n + i] * (s - one.s));
    const [r, q] = [one, two].map((node) => Math.sqrt(Math.abs(node.s - s)));
    const h = q - r, t = -r / h;
    return x.map((value, i) => {
      const [v, w] = [-2 * sense * r * one.state[n + i] * h, -2 * sense * q * two.state[n + i] * h];
      const rise = two.state[i] - value;
      return value + t * (v + t * (3 * rise - 2 * v - w + t * (v + w - 2 * rise)));
    });
  }

  /** The place on the path for a value of the driver, whole turns away where it gets there so. */
  placeOf(s) {
    const [low, high] = this.span();
    const slack = 1e-11 * this.way.largest(0); // what rounding leaves before the end of a range
    if (s >= low - slack && s <= high + slack) return s;
    if (!this.way.turns) return null;
    const turns = s < low ? Math.ceil((low - s) / FULL_TURN - 1e-12) : -Math.ceil((s - high) / FULL_TURN - 1e-12);
    const there = s + turns * FULL_TURN;
    return there >= low && there <= high ? there : null;
  }

  span() {
    const low = this.ends[0] ? this.ends[0].s : this.nodes[0].s;
    const high = this.ends[1] ? this.ends[1].s : this.nodes[this.nodes.length - 1].s;
    return [low, high];
  }

  guess(s) {
    const { nodes, n } = this;
    for (const [end, last] of [[this.ends[0], nodes[0]], [this.ends[1], nodes[nodes.length - 1]]]) {
      if (end && end.kind === "limit" && (s - last.s) * (end.s - s) > 0) return this.before(end, last, s);
    }
    if (nodes.length === 1) return nodes[0].state.slice(0, n);
    let k = 0;
    let high = nodes.length - 1;
    while (high - k > 1) {
      const middle = (k + high) >> 1;
      if (nodes[middle].s <= s) k = middle;
      else high = middle;
    }
    const a = nodes[k];
    const b = nodes[k + 1];
    const h = b.s - a.s;
    const t = (s - a.s) / h;
    const x = new Float64Array(n);
    for (let i = 0; i < n; i += 1) {
      const v0 = a.state[n + i] * h, v1 = b.state[n + i] * h;
      const a0 = a.state[2 * n + i] * h * h, a1 = b.state[2 * n + i] * h * h;
      const rise = b.state[i] - a.state[i];
      const c3 = 10 * rise - 6 * v0 - 4 * v1 - 1.5 * a0 + 0.5 * a1;
      const c4 = -15 * rise + 8 * v0 + 7 * v1 + 1.5 * a0 - a1;
      const c5 = 6 * rise - 3 * v0 - 3 * v1 - 0.5 * a0 + 0.5 * a1;
      x[i] = a.state[i] + t * (v0 + t * (0.5 * a0 + t * (c3 + t * (c4 + t * c5))));
    }
    return x;
  }

  /** A guess between the last node and a limit position, a parabola in the root of what is left. */
  before(end, last, s) {
    const reach = Math.sqrt(Math.abs(last.s - end.s)), root = Math.sqrt(Math.abs(s - end.s));
    return end.x.map((there, i) => {
      const rise = last.state[i] - there;
      const slope = last.state[this.n + i] * 2 * Math.sign(last.s - end.s) * reach;
      const bend = (slope * reach - rise) / reach ** 2;
      return there + root * (rise / reach - bend * reach + bend * root);
    });
  }

  /** The certified pose at a value of the driver. */
  pose(s) {
    const place = this.placeOf(s);
    if (place === null) return this.missing(s);
    for (const end of this.ends) {
      if (end && Math.abs(place - end.s) <= 1e-15 * Math.max(1, Math.abs(end.s)) * 8) {
        const there = end.kind === "limit" ? this.atLimit(s, end) : this.missing(s);
        return there.y && s !== place && !this.same(there.y[0], this.kernels.outputs.run(end.x, this.way.u(place), this.p)[0]) ? this.missing(s) : there;
      }
    }
    let found = this.solved(place, place, this.guess(place));
    if (found.status !== "ok") found = this.solved(place, place, this.beside(place));
    return s === place ? found : this.returned(s, found);
  }

  /** The pose at a value whole turns away from a pose that was found, if it is the same: a rack on the crank is elsewhere. */
  returned(s, { status, x, y }) {
    const own = status === "ok" ? this.solved(s, s, x) : null;
    return own && own.status === "ok" && this.same(own.y[0], y[0]) ? own : this.missing(s);
  }

  /** Whether outputs are the same but for whole turns of angles. */
  same(one, other) {
    return this.data.entries.every(({ columns, unit, names }) => columns.every((k) => {
      const apart = one[k] - other[k];
      if (unit !== "rad") return Math.abs(apart) <= RETURN * this.start.scale;
      return Math.abs(names[0] === "orientation" ? apart : apart - FULL_TURN * Math.round(apart / FULL_TURN)) <= RETURN;
    }));
  }

  /** A guess by certified steps from the node before a place, where the interpolant is too poor. */
  beside(place) {
    const { nodes, n } = this;
    let k = 0;
    while (k + 1 < nodes.length && nodes[k + 1].s <= place) k += 1;
    let { s, state } = nodes[k];
    this.lead(this.way.legAt(s, Math.sign(place - s) || 1));
    for (let tries = 0, step = place - s; tries < 200 && s !== place; tries += 1) {
      const next = Math.abs(step) >= Math.abs(place - s) ? place : s + step;
      const [after, test, det, miss] = this.step(state, s, next - s);
      if (this.proved(after, test, det, miss).length) step = (next - s) / 2;
      else {
        s = next;
        state = after.slice();
      }
    }
    return state.slice(0, n);
  }

  /** Newton's method from a guess, and everything that is reported; `signs` false: any branch. */
  solved(s, place, guess, signs = true) {
    let x = guess;
    let far = Infinity;
    for (let round = 0; round < ROUNDS; round += 1) {
      const [next, error, det, beta, eta, ...y] = this.posed(x, place);
      let left = 0;
      let h = 0;
      for (let b = 0; b < this.nb; b += 1) {
        left = Math.max(left, this.kappa[b] * beta[b] * eta[b]);
        h = Math.max(h, this.kappa[b] * beta[b] * Math.sqrt(eta[b]));
        if (signs && Math.sign(det[b]) !== this.sign[b]) {
          this.opened = b;
          return this.missing(s);
        }
        if (!(this.kappa[b] * beta[b] * Math.sqrt(eta[b]) <= H_LIMIT)) this.opened = b;
      }
      if (!Number.isFinite(left)) return this.missing(s);
      if (round === 0) far = h;
      if (far > H_LIMIT) return this.missing(s);
      x = copied(next);
      if (left <= TINY) {
        return { status: "ok", s, place, x, y: y.map(copied), error: copied(error), det: copied(det), beta: copied(beta) };
      }
    }
    return this.missing(s);
  }

  atLimit(s, end) {
    const [y] = this.kernels.outputs.run(end.x, this.way.u(s), this.p);
    const none = new Float64Array(y.length).fill(NaN);
    return { status: "limit", s, place: end.s, x: end.x, y: [Float64Array.from(y), none, none], error: null, end };
  }

  missing(s) {
    return { status: "unassembled", s, place: null, x: null, y: null, error: null };
  }

  /** Bounds of the outputs' errors from those of the unknowns, the largest of their coordinates. */
  bound({ error }) {
    if (!error) return null;
    const { slopes_at: [rows, columns], turned } = this.data.kernels;
    const slopes = this.outputSlopes();
    const sums = new Float64Array(this.rounding.length);
    for (let k = 0; k < rows.length; k += 1) sums[rows[k]] += slopes[k] * error[columns[k]];
    const { lengths, angles, matrices } = this.data.bounded;
    const largest = (own, share, wider, more) => share * Math.max(0, ...own.map((k) => sums[k])) + wider * Math.max(0, ...own.map((k) => this.rounding[k])) + more;
    // of rotations told as quaternions, as in mechdae/motion/continuation/output_bounds.py
    const angle = matrices.length ? largest(matrices, turned, Math.sqrt(21), 2 ** -49) : largest(angles, 1, 1, 0);
    return { length: largest(lengths, 1, 1, 0), angle };
  }

  /** Begin on the file's way at an assembly mode, with other values of the sliders; a word of what failed, "" nothing. */
  begin(mode, theta, way) {
    const { start, sliders } = this.data, nominal = sliders.map(({ value }) => value);
    this.way = way;
    this.setNumbers(nominal);
    const begun = this.solved(start.s, start.s, Float64Array.from(mode.x), false);
    if (begun.status !== "ok") return "unassembled";
    this.sign = Float64Array.from(begun.det, Math.sign);
    const { t, x } = this.carry(begun, nominal, theta);
    this.anchor = { x: Float64Array.from(x), s: start.s };
    return t < 1 ? "fades" : "";
  }

  /** Go over to another way by which one of several drivers moves, the others where `u` has them; whether that is proved. */
  aside(way, u) {
    const there = this.straightTo(u);
    if (there.t === 1) this.turnTo(way, there.x, u[way.k]);
    return there.t === 1;
  }

  /**
   * Carry a pose to other values of the sliders along a straight line, by certified Newton steps.
   * Returns how far it came, 1 for the whole way; the numbers are those of the place reached.
   */
  carry(pose, from, to) {
    let t = 0;
    let step = 1, growth = 2;
    let { x } = pose;
    let { det } = pose;
    while (t < 1) {
      const next = Math.min(1, t + step);
      this.setNumbers(from.map((value, i) => (next === 1 ? to[i] : value + next * (to[i] - value))));
      if (det) this.sign = Float64Array.from(det, Math.sign);
      const found = this.solved(pose.s, pose.place, x, Boolean(det));
      const real = found.status !== "ok" || found.y[0].every(Number.isFinite); // three sides may make no triangle
      if (!real) this.opened = -1;
      if (found.status === "ok" && real) {
        ({ x, det } = found);
        t = next;
        step *= growth;
      } else {
        step /= 2;
        growth = SLOWER; // twice as far would fail again: two tries for each half
        if (step < 2 ** -10) break;
      }
    }
    this.setNumbers(from.map((value, i) => (t === 1 ? to[i] : value + t * (to[i] - value))));
    return { t, x };
  }
}
