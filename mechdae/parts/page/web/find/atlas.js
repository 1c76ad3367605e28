/** An atlas of curves that the page computes itself: linkages of a low-discrepancy sequence, each with as many points of its coupler, which share its motion. */
import { around, FAMILIES } from "./families.js";
import { MIRRORED, momentsOf, NUMBERS } from "./moments.js";

export const POINTS_OF_EACH = 128;
const EACH = 36, TOTAL_SHARES = FAMILIES.reduce((sum, { share }) => sum + share, 0);
/** Numbers are kept in bytes: from -FARTHEST to FARTHEST. */
const FARTHEST = 3.2, SCALE = 127 / FARTHEST;

/** Term k of the additive sequence of a dimension (Roberts 2018). */
function sequence(dimension) {
  let root = 1.5;
  for (let k = 0; k < 60; k += 1) root = (1 + root) ** (1 / (dimension + 1));
  const steps = Array.from({ length: dimension }, (_, k) => root ** -(k + 1));
  return (k) => steps.map((step) => (0.5 + step * k) % 1);
}

/** Points of a coupler relative to its length: all around, nearer and farther. */
const POINTS = Array.from({ length: POINTS_OF_EACH }, (_, k) => {
  const [a, b] = sequence(2)(k + 1), far = Math.exp(-2 + 3.2 * a);
  return [far * Math.cos(2 * Math.PI * b), far * Math.sin(2 * Math.PI * b)];
});

export class Atlas {
  /** @param {number} linkages how many */
  constructor(linkages = 20480) {
    this.wanted = linkages;
    this.linkages = [];
    this.numbers = new Int8Array(linkages * POINTS_OF_EACH * NUMBERS);
    this.count = 0;
    this.tried = FAMILIES.map(() => 0);
    this.sequences = FAMILIES.map(({ count }) => sequence(count));
    this.room = { tau: around(EACH), U: new Float64Array(2 * EACH), V: new Float64Array(2 * EACH), z: new Float64Array(2 * EACH), lengths: new Float64Array(EACH + 1), own: new Float64Array(NUMBERS) };
  }

  get ready() { return this.linkages.length >= this.wanted; }

  /** The next linkage of the family that has too few; those that do not turn are passed over. */
  next() {
    const n = this.linkages.length;
    let at = n % TOTAL_SHARES, family = 0;
    while (at >= FAMILIES[family].share) { at -= FAMILIES[family].share; family += 1; }
    const { trace, numbers } = FAMILIES[family], { tau, U, V } = this.room;
    for (;;) {
      this.tried[family] += 1;
      const x = numbers(this.sequences[family](this.tried[family]));
      if (x && trace(x, tau, U, V)) return { family, x };
    }
  }

  /** Go on for some milliseconds; how much is done. */
  grow(milliseconds) {
    const end = performance.now() + milliseconds, { U, V, z, lengths, own } = this.room;
    while (!this.ready && performance.now() < end) {
      const linkage = this.next(), bar = linkage.bar = barOf(linkage);
      this.linkages.push(linkage);
      for (let j = 0; j < POINTS_OF_EACH; j += 1) {
        const cx = bar * POINTS[j][0], cy = bar * POINTS[j][1];
        for (let k = 0; k < 2 * EACH; k += 2) {
          z[k] = U[k] + cx * V[k] - cy * V[k + 1];
          z[k + 1] = U[k + 1] + cx * V[k + 1] + cy * V[k];
        }
        momentsOf(z, EACH, own, 0, lengths);
        const at = this.count * NUMBERS;
        for (let k = 0; k < NUMBERS; k += 1) this.numbers[at + k] = Math.max(-127, Math.min(127, Math.round(SCALE * own[k])));
        this.count += 1;
      }
    }
    return this.linkages.length / this.wanted;
  }

  /** The mechanism of a place in the atlas. */
  at(index) {
    const { family, x, bar } = this.linkages[Math.floor(index / POINTS_OF_EACH)];
    const [cx, cy] = POINTS[index % POINTS_OF_EACH];
    return { family, x, q: [bar * cx, bar * cy] };
  }

  /** The entries nearest to numbers, and to those of the mirrored curve: [index, mirrored, distance], as many of each family. */
  near(wanted, many) {
    const { numbers, linkages } = this, found = FAMILIES.map(() => []), w = Float64Array.from(wanted, (v) => SCALE * v);
    const worst = new Float64Array(FAMILIES.length).fill(Infinity);
    const put = (family, entry) => {
      const list = found[family];
      list.push(entry);
      if (list.length < 2 * many) return;
      list.sort((a, b) => a[2] - b[2]);
      list.length = many;
      worst[family] = list[many - 1][2];
    };
    for (let i = 0, at = 0; i < linkages.length; i += 1) {
      const { family } = linkages[i];
      for (let j = 0; j < POINTS_OF_EACH; j += 1, at += NUMBERS) {
        const most = worst[family];
        let sum = 0;
        for (let k = at, n = 0; n < 6; n += 1, k += 1) { const d = numbers[k] - w[n]; sum += d * d; }
        if (sum >= most) continue;
        for (let k = 6; k < MIRRORED; k += 1) { const d = numbers[at + k] - w[k]; sum += d * d; }
        let [plain, mirrored] = [sum, sum];
        for (let k = MIRRORED; k < NUMBERS; k += 1) {
          const v = numbers[at + k];
          plain += (v - w[k]) ** 2;
          mirrored += (v + w[k]) ** 2;
        }
        if (plain < most) put(family, [i * POINTS_OF_EACH + j, false, plain]);
        if (mirrored < most) put(family, [i * POINTS_OF_EACH + j, true, mirrored]);
      }
    }
    return found.map((list) => list.sort((a, b) => a[2] - b[2]).slice(0, many));
  }
}

/** The length that points of the body are measured by. */
const barOf = ({ family, x }) => Math.exp(FAMILIES[family].count > 5 ? x[7] : x[0]);
