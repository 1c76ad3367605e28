/** What goes in and comes out: names, units, values of the file. */
export const info = {
  driver: DATA.driver, range: DATA.range,
  inputs: DATA.sliders, outputs: DATA.entries.map(({ path, unit, columns }) => ({ path, unit, size: columns.length })),
};

/** The mechanism: `pose` follows its path to a value of the driver, `set` changes numbers. */
export class Mechanism {
  constructor() {
    this.motion = new Motion(DATA, KERNELS);
    this.theta = DATA.sliders.map(({ value }) => value);
    this.motion.follow(Math.min(DATA.range[0], DATA.start.s), Math.max(DATA.range[1], DATA.start.s));
  }

  /**
   * The pose at a value of the driver, reached on a path whose steps are proved.
   * @param {number} s value of the driver
   * @param {number} speed its rate, and
   * @param {number} acceleration its second one
   * @returns {{status: string, y: number[] | null, values: Object<string, number | number[]>}}
   *   `status` is "ok", "limit" or "unassembled"; `y` are all outputs in the order of the header,
   *   `values` those and their rates in time by name.
   */
  pose(s, speed = 1, acceleration = 0) {
    const { motion } = this;
    const [low, high] = motion.span();
    if (s < low) motion.extend(-1, s);
    if (s > high) motion.extend(1, s);
    if (motion.grow()) motion.bounds();
    const { status, y } = motion.pose(s);
    if (!y) return { status, y: null, dy: null, ddy: null, values: {} };
    const [value, first, second] = y.map((part) => Array.from(part));
    const values = {};
    for (const { kind, part, names, columns } of DATA.entries) {
      const put = (name, all) => { values[`${kind}/${part}/${name}`] = columns.length > 1 ? columns.map(all) : all(columns[0]); };
      put(names[0], (k) => value[k]);
      put(names[1], (k) => first[k] * speed);
      put(names[2], (k) => second[k] * speed * speed + first[k] * acceleration);
    }
    return { status, y: value, dy: first, ddy: second, values };
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
    return true;
  }

  /** The driver's values between which it can move, null where it turns fully. */
  limits() { return this.motion.ends.map((end) => (end ? end.s : null)); }
}
