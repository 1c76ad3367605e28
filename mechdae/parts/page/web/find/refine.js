/** A mechanism of a family fitted to places in their order: least squares over its numbers, place, size and point, each place at the driver's value
 * that is nearest to it (Gauss-Newton with the tangential part projected out, Levenberg's damping). */
import { FAMILIES } from "./families.js";

const STEP = 1e-6, EXACT = 1e-20;

/** Solve a symmetric system in place by Cholesky's factors; false where it is not positive. */
function solved(A, b, n) {
  for (let j = 0; j < n; j += 1) {
    for (let i = j; i < n; i += 1) {
      let sum = A[i * n + j];
      for (let k = 0; k < j; k += 1) sum -= A[i * n + k] * A[j * n + k];
      if (i === j) { if (!(sum > 0)) return false; A[i * n + i] = Math.sqrt(sum); } else A[i * n + j] = sum / A[j * n + j];
    }
  }
  for (let i = 0; i < n; i += 1) { for (let k = 0; k < i; k += 1) b[i] -= A[i * n + k] * b[k]; b[i] /= A[i * n + i]; }
  for (let i = n - 1; i >= 0; i -= 1) { for (let k = i + 1; k < n; k += 1) b[i] -= A[k * n + i] * b[k]; b[i] /= A[i * n + i]; }
  return true;
}

export class Fit {
  /** @param {number} family @param {number} n how many places */
  constructor(family, n) {
    this.trace = FAMILIES[family].trace;
    this.shapes = FAMILIES[family].count;
    this.n = n;
    const own = () => new Float64Array(2 * n);
    [this.U, this.V, this.U2, this.V2, this.z, this.z2, this.slope] = Array.from({ length: 7 }, own);
    this.many = 6 + this.shapes;
    this.ways = Array.from({ length: this.many }, own);
    this.later = new Float64Array(n);
    const m = this.many;
    [this.JJ, this.A, this.g, this.next, this.step, this.times] = [m * m, m * m, m, m, m, n].map((count) => new Float64Array(count));
  }

  /** Places z for numbers y = [o, p, q, x...] at values of the driver; false where it does not assemble. */
  placed(y, tau, U, V, z) {
    if (!this.trace(y.subarray(6), tau, U, V)) return false;
    for (let k = 0; k < 2 * this.n; k += 2) {
      z[k] = y[0] + y[2] * U[k] - y[3] * U[k + 1] + y[4] * V[k] - y[5] * V[k + 1];
      z[k + 1] = y[1] + y[2] * U[k + 1] + y[3] * U[k] + y[4] * V[k + 1] + y[5] * V[k];
    }
    return true;
  }

  /** Places by the driver. */
  sloped(y, tau) {
    for (let k = 0; k < this.n; k += 1) this.later[k] = tau[k] + STEP;
    if (!this.placed(y, this.later, this.U2, this.V2, this.slope)) return false;
    for (let k = 0; k < 2 * this.n; k += 1) this.slope[k] = (this.slope[k] - this.z[k]) / STEP;
    return true;
  }

  /** Sum of the squares of the distances from targets. */
  misses(targets) {
    let sum = 0;
    for (let k = 0; k < 2 * this.n; k += 1) sum += (targets[k] - this.z[k]) ** 2;
    return sum;
  }

  /** Columns: places by each number, at y and tau; false where it assembles on neither side. */
  derived(y, tau, next) {
    const { ways, U, V, z, n } = this;
    for (let k = 0; k < 2 * n; k += 2) {
      ways[0][k] = 1; ways[1][k + 1] = 1;
      ways[2][k] = U[k]; ways[2][k + 1] = U[k + 1]; ways[3][k] = -U[k + 1]; ways[3][k + 1] = U[k];
      ways[4][k] = V[k]; ways[4][k + 1] = V[k + 1]; ways[5][k] = -V[k + 1]; ways[5][k + 1] = V[k];
    }
    next.set(y);
    for (let j = 6; j < this.many; j += 1) {
      const way = ways[j];
      let h = STEP;
      next[j] = y[j] + h;
      if (!this.placed(next, tau, this.U2, this.V2, way)) {
        h = -STEP;
        next[j] = y[j] + h;
        if (!this.placed(next, tau, this.U2, this.V2, way)) return false;
      }
      next[j] = y[j];
      for (let k = 0; k < 2 * n; k += 1) way[k] = (way[k] - z[k]) / h;
    }
    return true;
  }

  /** Normal equations across the curve: what is along it is the driver's. */
  summed(targets, JJ, g, row) {
    const { ways, slope, z, n, many } = this;
    JJ.fill(0);
    g.fill(0);
    for (let k = 0; k < 2 * n; k += 2) {
      const tx = slope[k], ty = slope[k + 1], long = Math.sqrt(tx * tx + ty * ty) || 1, nx = -ty / long, ny = tx / long;
      const r = nx * (targets[k] - z[k]) + ny * (targets[k + 1] - z[k + 1]);
      for (let i = 0; i < many; i += 1) {
        const own = nx * ways[i][k] + ny * ways[i][k + 1];
        row[i] = own;
        g[i] += own * r;
        for (let j = 0, at = i * many; j <= i; j += 1) JJ[at + j] += own * row[j];
      }
    }
  }

  /** Values of the driver after a step, to first order where the places are nearest. */
  slid(tau, targets, step, times) {
    const { ways, slope, z, n, many } = this;
    for (let k = 0; k < 2 * n; k += 2) {
      let rx = targets[k] - z[k], ry = targets[k + 1] - z[k + 1];
      for (let i = 0; i < many; i += 1) { rx -= step[i] * ways[i][k]; ry -= step[i] * ways[i][k + 1]; }
      const tx = slope[k], ty = slope[k + 1], long = tx * tx + ty * ty || 1;
      times[k >> 1] = tau[k >> 1] + Math.max(-0.3, Math.min(0.3, (rx * tx + ry * ty) / long));
    }
  }

  /** Fit from y and tau, which are changed; the sum of squares, of targets of size 1. `good`: what is farther off after eight rounds is given up. */
  fit(y, tau, targets, rounds = 30, good = Infinity) {
    const { many, JJ, A, g, next, step, times } = this;
    if (!this.placed(y, tau, this.U, this.V, this.z)) return Infinity;
    let miss = this.misses(targets), damping = 1e-3;
    for (let round = 0; round < rounds; round += 1) {
      if (!this.sloped(y, tau) || !this.derived(y, tau, next)) return miss;
      this.summed(targets, JJ, g, step);
      let better = 0;
      for (let tries = 0; tries < 6 && !better; tries += 1, damping *= 6) {
        A.set(JJ);
        for (let i = 0; i < many; i += 1) A[i * many + i] += damping * (JJ[i * many + i] + 1e-9);
        step.set(g);
        if (!solved(A, step, many)) continue;
        for (let i = 0; i < many; i += 1) next[i] = y[i] + step[i];
        this.slid(tau, targets, step, times);
        [this.z, this.z2] = [this.z2, this.z];
        const own = this.placed(next, times, this.U2, this.V2, this.z) ? this.misses(targets) : Infinity;
        if (own < miss) {
          better = miss - own;
          y.set(next);
          tau.set(times);
          miss = own;
          [this.U, this.U2, this.V, this.V2] = [this.U2, this.U, this.V2, this.V];
          damping = Math.max(damping / 48, 1e-12);
        } else [this.z, this.z2] = [this.z2, this.z];
      }
      if (miss < EXACT || better < 1e-6 * miss || (round >= 7 && miss > good)) return miss;
    }
    return miss;
  }
}
