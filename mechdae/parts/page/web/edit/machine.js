/** A drawn mechanism as the page's session takes it: data and kernels, of one block of equations, with the same proofs. */
import { applied, inverted, Place } from "./rows.js";
import { FULL_TURN, STEP_OF_TURN, turnOf } from "../way.js";

const UNIT_ROUNDING = 2 ** -53, STEP_LIMIT = 0.45, RATE_NAMES = {
  angle: ["angle", "angular_velocity", "angular_acceleration"], slide: ["slide", "slide_velocity", "slide_acceleration"],
  position: ["position", "velocity", "acceleration"] };

/** Norm of |Y| times a bound of each row. */
const weighed = (inverse, bounds) => Math.hypot(...inverse.map((line) => { let sum = 0; for (let j = 0; j < line.length; j += 1) sum += Math.abs(line[j]) * bounds[j]; return sum; }));

/** Kernels over the rows of joints and of drivers, and data beside them. */
export class Machine {
  /** @param {any} rows `Rows` @param {any[]} drivers {name, speed, acceleration, usual} @param {number[]} q the pose that is drawn */
  constructor(rows, drivers, q) {
    const { mechanism } = rows;
    Object.assign(this, { rows, n: rows.n, q, drivers });
    this.led = drivers.map(({ name }) => rows.coordinate(name));
    this.all = [...rows.joints.map((row) => this.settled(row)), ...this.led];
    this.u = this.led.map((row) => new Place(q).value(row) * row.unit);
    this.entries = [];
    this.told = [];
    const entry = (kind, part, name, list, unit) => {
      this.entries.push({ kind, part, names: RATE_NAMES[name], columns: list.map((_, k) => this.told.length + k), unit });
      this.told.push(...list);
    };
    for (const { name, points } of mechanism.bodies) {
      entry("bodies", name, "angle", [rows.coordinate(`${name}.angle`)], "rad");
      for (const point of points.keys()) entry("points", `${name}.${point}`, "position", ["x", "y"].map((axis) => rows.coordinate(`${name}.${point}.${axis}`)), "m");
    }
    for (const { name, kind, drawn } of mechanism.joints) {
      if (!drawn) continue;
      if (["prismatic", "pin-in-slot"].includes(kind)) entry("joints", name, "slide", [rows.coordinate(`${name}.slide`)], "m");
      if (["revolute", "pin-in-slot"].includes(kind)) entry("joints", name, "angle", [rows.coordinate(`${name}.angle`)], "rad");
    }
  }

  /** A row with the number of whole turns that it has in the drawn pose. */
  settled(row) {
    if (!row.wraps) return row;
    const plain = { ...row, wraps: false };
    return { ...plain, constant: row.constant - FULL_TURN * Math.round(new Place(this.q).value(plain) / FULL_TURN) };
  }

  residuals(place, u) {
    const found = this.all.map((row) => place.value(row));
    this.led.forEach(({ unit }, k) => { found[this.n - this.led.length + k] -= u[k] / unit; });
    return found;
  }

  matrix(place) { return this.all.map((row) => place.gradient(row, new Float64Array(this.n))); }

  /** Rates of the unknowns when the drivers have rates. */
  rates(place, inverse, first, second) {
    const right = new Float64Array(this.n), at = this.n - this.led.length;
    this.led.forEach(({ unit }, k) => { right[at + k] = first[k] / unit; });
    const v = applied(inverse, right);
    const bends = this.all.map((row, i) => (i < at ? 0 : second[i - at] / this.led[i - at].unit) - place.bend(row, v));
    return [v, applied(inverse, bends)];
  }

  newton(q, u) {
    const place = new Place(q), found = inverted(this.matrix(place));
    if (!found) return null;
    const step = applied(found.rows, this.residuals(place, u));
    return { next: q.map((value, i) => value - step[i]), size: Math.hypot(...step), place, ...found };
  }

  /** How fast the scaled Jacobian may change around a pose: what eta is multiplied by. */
  change(place, inverse) { return weighed(inverse, this.all.map((row) => place.lipschitz(row))); }

  noise(place) { return this.all.map((row) => 8 * UNIT_ROUNDING * (1 + Math.abs(row.constant) + (row.one ? place.reach(row) : 8)) + (row.follows ? (row.follows.loop.miss(place.q[row.follows.at]) + 64 * UNIT_ROUNDING * row.follows.loop.most[row.follows.axis]) / row.follows.size : 0)); }

  values(place, v, a) {
    const line = new Float64Array(this.n);
    const found = [[], [], []];
    for (const row of this.told) {
      found[0].push(place.value(row) * row.unit);
      if (!v) continue;
      line.fill(0);
      place.gradient(row, line);
      let one = 0, two = place.bend(row, v);
      for (let j = 0; j < this.n; j += 1) { one += line[j] * v[j]; two += line[j] * a[j]; }
      found[1].push(one * row.unit);
      found[2].push(two * row.unit);
    }
    return found;
  }

  pose(q, u, first, second) {
    const nothing = () => [q.map(() => NaN), q.map(() => NaN), [NaN], [NaN], [NaN], ...[0, 1, 2].map(() => this.told.map(() => NaN))];
    const step = this.newton(Array.from(q), u);
    if (!step || !(step.size <= 0.25)) return nothing();
    const place = new Place(step.next), found = inverted(this.matrix(place));
    if (!found) return nothing();
    const change = this.change(step.place, step.rows), off = weighed(found.rows, this.noise(place));
    const [v, a] = this.rates(place, found.rows, first, second);
    const error = off + 2 * change * (step.size ** 2 + 2 * off * off) + 4 * UNIT_ROUNDING;
    return [step.next, q.map(() => error), [found.sign], [change], [step.size ** 2], ...this.values(place, v, a)];
  }

  /** Everything at the start of a step that does not depend on its length, held for tries of other lengths. */
  begun(x) {
    if (!this.known || this.known.x.some((value, i) => value !== x[i])) {
      const place = new Place(x), found = inverted(this.matrix(place));
      this.known = { x, place, inverse: found && found.rows, change: found && this.change(place, found.rows) };
    }
    return this.known;
  }

  advance(state, s, ds, u0, d) {
    const { n } = this, x = Array.from(state.subarray(0, n)), u = (at) => u0.map((value, k) => value + at * d[k]);
    const failed = () => [new Float64Array(3 * n + 1).fill(NaN), [Infinity], [NaN], [Infinity]];
    let q = x.map((value, i) => value + state[n + i] * ds + (state[2 * n + i] * ds * ds) / 2), size = 0;
    for (let round = 0; round < 3; round += 1) {
      const step = this.newton(q, u(s + ds));
      if (!step) return failed();
      q = step.next;
      ({ size } = step);
      if (size < 1e-14) break;
    }
    const place = new Place(q), found = inverted(this.matrix(place));
    if (!found) return failed();
    const [v, a] = this.rates(place, found.rows, d, d.map(() => 0));
    const change = this.change(place, found.rows);
    const after = new Float64Array(3 * n + 1);
    [q, v, a, [change]].forEach((part, k) => after.set(part, k * n));
    const { test, radius } = ds === 0 ? { test: 0, radius: 1 } : this.tube(x, Array.from(state.subarray(n, 2 * n)), ds, u(s));
    const gap = Math.hypot(...q.map((value, i) => value - x[i] - state[n + i] * ds));
    return [after, [Math.max(test, (change * size) / 0.2)], [found.sign], [ds === 0 ? 0 : gap / (radius * (1 + 1e-6) + 1e-300)]];
  }

  /** Whether the drawn pose has rates, from which its path goes on. */
  get starts() {
    const state = new Float64Array(3 * this.n + 1);
    state.set(this.q);
    return this.advance(state, 0, 0, this.u, this.u.map(() => 1))[0].every(Number.isFinite);
  }

  /** The certificate of a step: one solution stays within a radius of the tangent (as in `kernels/graphs/steps.py`). */
  tube(x, v, ds, u) {
    const { place, inverse, change } = this.begun(x), none = { test: Infinity, radius: 0 };
    if (!inverse) return none;
    const long = Math.abs(ds), n = this.n, lines = this.all.map(() => new Float64Array(n)), noise = this.noise(place);
    const open = this.residuals(place, u);
    const residual = this.all.map((row, i) => Math.abs(open[i]) + (long * long * place.ahead(row, v, long, lines[i])) / 2 + 2 * noise[i]);
    let sum = 0;
    for (const line of inverse) for (let j = 0; j < n; j += 1) { let own = 0; for (let i = 0; i < n; i += 1) own += Math.abs(line[i]) * lines[i][j]; sum += own * own; }
    const delta = Math.sqrt(sum);
    if (!(delta < 0.9)) return none;
    const grown = 1 / (1 - delta), eta = grown * weighed(inverse, residual), h = grown * change * eta;
    const radius = (2 * eta) / (1 + Math.sqrt(Math.max(1 - 2 * h, 0)));
    return { test: Math.max(delta / 0.9, h / STEP_LIMIT, radius + long * Math.hypot(...v)), radius };
  }

  /** Equations of a limit position {F = 0, J w = 0, w . w = 1} with derivatives, and J, column by column. */
  fold(y, u0, d) {
    const { n } = this, q = Array.from(y.slice(0, n)), s = y[n], w = Array.from(y.slice(n + 1)), place = new Place(q), m = 2 * n + 1;
    const J = this.matrix(place), F = this.residuals(place, u0.map((value, k) => value + s * d[k]));
    const G = new Float64Array(m), Gy = new Float64Array(m * m), at = n - this.led.length;
    // the bend is a quadratic form: its gradient is that of differences
    for (let i = 0; i < n; i += 1) {
      G[i] = F[i];
      for (let j = 0; j < n; j += 1) { G[n + i] += J[i][j] * w[j]; Gy[i + m * j] = J[i][j]; Gy[n + i + m * (n + 1 + j)] = J[i][j]; }
      if (i >= at) Gy[i + m * n] = -d[i - at] / this.led[i - at].unit;
      const row = this.all[i];
      if (!row.one) continue;
      const base = place.bend(row, w);
      const of = new Set([row.one.k, row.two.k, row.length ? -1 : row.k].filter((k) => k >= 0).flatMap((k) => [3 * k, 3 * k + 1, 3 * k + 2]));
      for (const j of row.follows ? of.add(row.follows.at) : of) {
        const one = [...w];
        one[j] += 1;
        const unit = w.map((_, i2) => (i2 === j ? 1 : 0));
        Gy[n + i + m * j] = (place.bend(row, one) - base - place.bend(row, unit)) / 2;
      }
    }
    G[m - 1] = w.reduce((sum, value) => sum + value * value, -1);
    w.forEach((value, j) => { Gy[m - 1 + m * (n + 1 + j)] = 2 * value; });
    const flat = new Float64Array(n * n);
    J.forEach((line, i) => line.forEach((value, j) => { flat[i + n * j] = value; }));
    return [G, Gy, flat];
  }

  /** What the session runs: functions over one memory, and where in it inputs and outputs are. */
  kernels() {
    const { n, led: { length: nu }, told } = this, layout = {}, code = {};
    const consts = 3 + n, whole = consts + 2 * nu;
    const made = (name, inputs, outputs, run) => {
      let at = 0;
      const place = (count) => { const own = [at, count]; at += count; return own; };
      const [given, found] = [inputs.map(place), outputs.map(place)];
      layout[name] = { in: given, out: found };
      code[name] = Object.assign((memory) => {
        const results = run(...given.map(([from, count]) => memory.subarray(from, from + count)));
        found.forEach(([from, count], k) => { for (let j = 0; j < count; j += 1) memory[from + j] = results[k][j]; });
      }, { size: at });
    };
    const way = (all) => [Array.from(all.subarray(consts, consts + nu)), Array.from(all.subarray(consts + nu))];
    const fixed = [...this.rows.mechanism.ground.values()].flat();
    const y = told.length, poseOut = [n, n, 1, 1, 1, y, y, y];
    const { slopes, rounding, at } = this.slopes();
    made("numbers", [0], [0], () => [[]]);
    made("looks", [0], [0], () => [[]]);
    made("ground", [0], [fixed.length], () => [fixed]);
    made("outputs", [n, nu, 0], [y], (x) => [this.values(new Place(Array.from(x)))[0]]);
    made("constants", [n, nu, 0, 1, 0], [1, 1, 1], () => [[1], [0], [1]]);
    made("slopes", [n, nu, 0, 0], [slopes.length, y], () => [slopes, rounding]);
    made("advance", [3 * n + 1, 2, whole], [3 * n + 1, 1, 1, 1], (state, [s, ds], all) => this.advance(state, s, ds, ...way(all)));
    made("fold0", [2 * n + 1, whole], [2 * n + 1, (2 * n + 1) ** 2, n * n], (point, all) => this.fold(point, ...way(all)));
    if (nu === 1) made("pose", [n, 1, consts], poseOut, (x, u) => this.pose(x, u, [1], [0]));
    else made("pose", [n, nu, nu, nu, consts], poseOut, (x, u, first, second) => this.pose(x, Array.from(u), Array.from(first), Array.from(second)));
    return { code, layout: { ...layout, slopes_at: at, looks_at: [], turned: 0 } };
  }

  /** Bounds of what each output changes by per unit of the unknowns. */
  slopes() {
    const slopes = [], rows = [], columns = [], place = new Place(this.q);
    const put = (i, j, value) => { rows.push(i); columns.push(j); slopes.push(value); };
    const rounding = this.told.map((row, i) => {
      for (const [k, c] of row.linear) put(i, 3 * k + 2, Math.abs(c) * row.unit);
      if (!row.one) return 0;
      for (const { k, r } of [row.one, row.two]) for (let j = 0; k >= 0 && j < 3; j += 1) put(i, 3 * k + j, (j < 2 ? 1 : r) * row.unit);
      if (row.k >= 0) put(i, 3 * row.k + 2, place.reach(row) * row.unit);
      return 4 * UNIT_ROUNDING * place.reach(row) * row.unit;
    });
    return { slopes, rounding, at: [rows, columns] };
  }

  /** What the session reads beside the kernels. @param {any} scene */
  data(scene) {
    const { n, led, u, rows } = this, { code, layout } = this.kernels(), single = led.length === 1;
    const turns = single && led[0].unit === 1, size = led.map(({ unit }) => unit);
    const drivers = this.drivers.map(({ name, speed, acceleration, usual }, k) => ({ name, unit: led[k].unit === 1 ? "rad" : "m", size: size[k], speed, acceleration, usual, turns: led[k].unit === 1 }));
    const columnsOf = (unit) => this.entries.filter((own) => own.unit === unit).flatMap(({ columns }) => columns);
    const begin = turns ? turnOf(u[0]) : u[0];
    const data = {
      kernels: layout, entries: this.entries, sliders: [], shape: {}, modes: [], checks: [], forces: null, live: true, scene,
      bounded: { lengths: columnsOf("m"), angles: columnsOf("rad"), matrices: [] },
      driver: { name: drivers[0].name, unit: drivers[0].unit }, drivers: single ? null : drivers,
      way: { kind: single ? "one" : "alone", u: single ? [0] : u, driver: 0, largest: STEP_OF_TURN * size[0], name: drivers[0].name, unit: drivers[0].unit },
      range: turns ? [begin, begin + FULL_TURN] : [u[0], u[0]], whole: true, poses: 361, limits: [null, null], pace: 1,
      speed: drivers[0].speed, acceleration: drivers[0].acceleration,
      start: { x: Array.from(this.q), s: u[0], size_x: Array.from({ length: n }, () => 1e9), size_u: led.map(() => 1e9), scale: rows.size, largest: STEP_OF_TURN * size[0],
        most: 2000, far: Array.from({ length: n }, () => null), turns, floors: 0, boxes: null, weights: Array.from({ length: n }, () => 1),
        blocks: [{ own: Array.from({ length: n }, (_, k) => k), chain: Array.from({ length: n }, (_, k) => k), group: "", joint: "" }], nx: n, nb: 1, nu: led.length },
    };
    return { data, code };
  }
}
