/** The other assembly modes: each is carried to the numbers shown and followed to the driver's value. */
import { Motion } from "./path.js";
import { aloneOf, wayOf } from "./way.js";

export class Ghosts {
  /** @param {any} data @param {any} code */
  constructor(data, code) {
    this.data = data;
    this.code = code;
    this.motions = new Map();
    this.known = "";
  }

  /** Carry all modes but the one shown to the numbers; false costs nothing where they are there. */
  carry(theta, range, shown, way, u) {
    const beside = this.data.drivers && way.held ? u : null; // values of several drivers that the file's way does not have
    const key = JSON.stringify([theta, range, shown, beside && way.name, beside && way.held]);
    if (key === this.known) return;
    this.known = key;
    const { start, sliders, modes } = this.data;
    for (const mode of modes) {
      const motion = this.motions.get(mode.label) || new Motion(this.data, this.code);
      this.motions.set(mode.label, motion);
      motion.there = mode.label !== shown && this.bring(motion, mode, sliders.map((slider) => slider.value), theta, start.s, range, beside && [u, way.k]);
    }
  }

  bring(motion, mode, nominal, theta, s, [low, high], beside) {
    motion.way = wayOf(this.data, motion.kernels);
    motion.setNumbers(nominal);
    const begun = motion.solved(s, s, Float64Array.from(mode.x), false);
    if (begun.status !== "ok") return false;
    motion.sign = Float64Array.from(begun.det, Math.sign);
    const found = motion.carry(begun, nominal, theta);
    if (found.t < 1) return false;
    motion.anchor = { x: Float64Array.from(found.x), s };
    if (beside) {
      const [u, k] = beside;
      const there = motion.straightTo(u);
      if (there.t < 1) return false;
      motion.turnTo(aloneOf(this.data, u, k), there.x, u[k]);
      return motion.follow(Math.min(low, u[k]), Math.max(high, u[k]));
    }
    return motion.follow(Math.min(low, s), Math.max(high, s));
  }

  /** Labels and poses of the modes that exist at a value of the driver. */
  at(s) {
    const found = [];
    for (const [label, motion] of this.motions) {
      const pose = motion.there ? motion.pose(s) : null;
      if (pose && pose.y) found.push({ label, pose });
    }
    return found;
  }
}
