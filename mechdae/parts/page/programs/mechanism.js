/** What goes in and comes out: names, units, values of the file. */
export const info = {
  ...(DATA.drivers ? { drivers: DATA.drivers } : { driver: DATA.driver, range: DATA.range }),
  inputs: DATA.sliders, outputs: DATA.entries.map(({ path, unit, columns }) => ({ path, unit, size: columns.length })),
};

/** The mechanism: `pose` follows its path to a value of the driver, `set` changes numbers. */
export class Mechanism {
  constructor() {
    this.motion = new Motion(DATA, KERNELS);
    this.theta = DATA.sliders.map(({ value }) => value);
    this.motion.follow(Math.min(DATA.range[0], DATA.start.s), Math.max(DATA.range[1], DATA.start.s));
    this.last = this.motion.pose(DATA.start.s);
  }

  /**
   * The pose at a value of the driver, or at those of several, reached by proved steps: of several
   * on the straight line from the pose before, which stays where the way is not proved.
   * @param {number | number[]} s value of the driver
   * @param {number | number[]} speed its rate (1; of several 0), and
   * @param {number | number[]} acceleration its second one
   * @returns {{status: string, y: number[] | null, values: Object<string, number | number[]>}}
   *   `status` is "ok", "limit" or "unassembled"; `y` are all outputs in the order of the header,
   *   `values` those and their rates in time by name. Of several drivers `dy` and `ddy` are rates
   *   in time, of one derivatives by its value. `bound` is how far lengths and angles are off at
   *   most, `share` how far the way to a refused pose is proved.
   */
  pose(s, speed, acceleration) {
    const { motion } = this;
    const { share, found } = DATA.drivers ? this.straight(s, speed, acceleration) : { share: 1, found: this.along(s) };
    const { status, y } = found;
    if (!y) return { status, y: null, dy: null, ddy: null, values: {}, share };
    this.last = found;
    const [value, first, second] = y.map((part) => Array.from(part));
    const [v, a] = DATA.drivers ? [1, 0] : [speed ?? 1, acceleration ?? 0];
    const values = {};
    for (const { kind, part, names, columns } of DATA.entries) {
      const put = (name, all) => { values[`${kind}/${part}/${name}`] = columns.length > 1 ? columns.map(all) : all(columns[0]); };
      put(names[0], (k) => value[k]);
      put(names[1], (k) => first[k] * v);
      put(names[2], (k) => second[k] * v * v + first[k] * a);
    }
    return { status, y: value, dy: first, ddy: second, values, bound: motion.bound(found), condition: motion.condition(found), share };
  }

  /** The pose on the path of the one driver. */
  along(s) {
    const { motion } = this;
    const [low, high] = motion.span();
    if (s < low) motion.extend(-1, s);
    if (s > high) motion.extend(1, s);
    if (motion.grow()) motion.bounds();
    return motion.pose(s);
  }

  /** The pose at values of several drivers; the one before is kept where it is not reached. */
  straight(u, speed, acceleration) {
    const { motion } = this;
    const { way, anchor } = motion;
    const still = DATA.drivers.map(() => 0);
    const rates = [speed ?? still, acceleration ?? still];
    if (![u, ...rates].every((part) => part.length === still.length)) throw new RangeError(`${still.length} values are needed, one for each driver`);
    if (![u, ...rates].every((part) => part.every(Number.isFinite))) return { share: 0, found: motion.missing(0) };
    const { t, x } = motion.straightTo(u);
    if (t === 1) {
      motion.turnTo(Object.assign(straightOf(DATA, u, u), { given: [...rates, still] }), x, 0);
      const found = motion.solved(0, 0, x);
      if (found.status === "ok") return { share: 1, found };
    }
    motion.turnTo(way, anchor.x, anchor.s);
    return { share: t, found: motion.missing(0) };
  }

  /** Derivatives of all outputs by each of several drivers at the last pose: a row for each output. */
  jacobian() {
    const { motion, last } = this;
    const columns = last.y[0].map((_, k) => k);
    if (!DATA.drivers) return last.y[1].map((value) => [value]);
    const u = Array.from(motion.way.u(0));
    const slopes = u.map((_, k) => motion.slopesBy(last.x, u, k, Array.from(columns)));
    return Array.from(columns, (k) => slopes.map((slope) => slope[k]));
  }

  /**
   * Use other numbers, reached along a straight line from those used now.
   * @param {Object<string, number>} numbers values by name, SI
   * @returns {boolean} false where the mechanism ceases to assemble on the way: then nothing changed
   */
  set(numbers) {
    for (const name of Object.keys(numbers)) if (!DATA.sliders.some((own) => own.name === name)) throw new RangeError(`no input ${name}`);
    const { motion } = this;
    const to = DATA.sliders.map(({ name }, k) => (name in numbers ? numbers[name] : this.theta[k]));
    const { s, x } = motion.anchor;
    const from = motion.solved(s, s, x, false);
    if (from.status !== "ok") return false;
    const { t, x: reached } = motion.carry(from, this.theta, to);
    if (t < 1) {
      motion.setNumbers(this.theta);
      return false;
    }
    this.theta = to;
    motion.anchor = { s, x: reached };
    motion.follow(Math.min(DATA.range[0], s), Math.max(DATA.range[1], s));
    this.last = motion.pose(s);
    return true;
  }

  /** The driver's values between which it can move, null where it turns fully. */
  limits() { return this.motion.ends.map((end) => (end ? end.s : null)); }
}
