/** Closed curves as trigonometric sums: places with derivatives, and bounds of these that hold all along. */
import { FULL_TURN } from "../way.js";

const FEWEST = 32, MOST = 512, TAIL = 1e-14, CHECKED = 700, SAME = 1e-10;

/** Coefficients [cosine, sine] of a function that is given at places of one period. */
function harmonics(values) {
  const n = values.length, circle = Array.from({ length: n }, (_, j) => [Math.cos((FULL_TURN * j) / n), Math.sin((FULL_TURN * j) / n)]);
  return Array.from({ length: n / 2 }, (_, k) => {
    let [a, b] = [0, 0];
    for (let j = 0; j < n; j += 1) { const [c, s] = circle[(j * k) % n]; a += values[j] * c; b += values[j] * s; }
    return [((k ? 2 : 1) * a) / n, (2 * b) / n];
  });
}

class Loop {
  /** @param {[number, number][][]} axes coefficients of x and of y @param {number} left what is left out @param {(angle: number) => number[]} given the curve itself, from whose loop `base` it may come */
  constructor(axes, left, given, base = null) {
    Object.assign(this, { axes, left, given, base });
    /** Most of the values and of their second derivatives. */
    [this.most, this.bends] = [0, 2].map((order) => axes.map((own) => own.reduce((sum, [a, b], k) => sum + k ** order * Math.hypot(a, b), 0)));
  }

  /** x (0) or y (1) at an angle, or a derivative. */
  value(angle, axis, order = 0) {
    const turn = (order * Math.PI) / 2;
    return this.axes[axis].reduce((sum, [a, b], k) => sum + (order ? k ** order : 1) * (a * Math.cos(k * angle + turn) + b * Math.sin(k * angle + turn)), 0);
  }

  /** How far it may be from the curve at an angle. */
  miss(angle) {
    const [x, y] = this.given(angle), [u, v] = this.at(angle);
    return this.left + Math.hypot(x - u, y - v) + (this.base ? this.base.miss(angle) : 0);
  }

  at(angle) { return [this.value(angle, 0), this.value(angle, 1)]; }

  /** Its parallel on the right, for negative distances on the left; null where it is no smooth one. */
  beside(distance) {
    if (!distance) return this;
    return loopOf((angle) => {
      const [u, v] = [0, 1].map((axis) => this.value(angle, axis, 1)), long = Math.hypot(u, v);
      return [this.value(angle, 0) + (distance * v) / long, this.value(angle, 1) - (distance * u) / long];
    }, this);
  }
}

/** A closed curve given by its places at angles; null where no sum of sines is that curve, there and between. @param {(angle: number) => number[]} at @param {Loop} [base] */
export function loopOf(at, base) {
  for (let n = FEWEST; n <= MOST; n *= 2) {
    const places = Array.from({ length: n }, (_, j) => at((FULL_TURN * j) / n)), axes = [0, 1].map((axis) => harmonics(places.map((place) => place[axis])));
    const size = Math.max(...axes.flat(2).map(Math.abs)), rest = Math.max(...axes.flatMap((own) => own.slice((3 * n) / 8)).flat().map(Math.abs));
    if (!(rest < TAIL * size)) continue;
    const last = Math.max(...axes.map((own) => own.findLastIndex((pair) => Math.hypot(...pair) > TAIL * size)));
    const loop = new Loop(axes.map((own) => own.slice(0, last + 1)), n * TAIL * size, at, base);
    if (Array.from({ length: CHECKED }, (_, k) => loop.miss((FULL_TURN * (k + 0.5)) / CHECKED)).every((miss) => miss < SAME * size)) return loop;
  }
  return null;
}
