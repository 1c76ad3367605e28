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
    this.k = beside && way.k;
    for (const mode of this.data.modes) {
      const motion = this.motions.get(mode.label) || new Motion(this.data, this.code);
      this.motions.set(mode.label, motion);
      motion.there = mode.label !== shown && this.bring(motion, mode, theta, range, beside);
    }
  }

  bring(motion, mode, theta, [low, high], beside) {
    if (motion.begin(mode, theta, wayOf(this.data, motion.kernels))) return false;
    if (beside && !motion.aside(aloneOf(this.data, beside, this.k), beside)) return false;
    const { s } = motion.anchor;
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
