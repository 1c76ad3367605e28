/** Complex numbers as pairs, and roots of real polynomials. */
import { FULL_TURN } from "../way.js";

export const added = (a, b) => [a[0] + b[0], a[1] + b[1]];
export const minus = (a, b) => [a[0] - b[0], a[1] - b[1]];
export const multiplied = (a, b) => [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]];
export const conj = (a) => [a[0], -a[1]];
export const scaled = (k, a) => [k * a[0], k * a[1]];
export const direction = (angle) => [Math.cos(angle), Math.sin(angle)];
export const norm = (a) => Math.hypot(a[0], a[1]);
export const angleOf = (a) => Math.atan2(a[1], a[0]);
/** Scalar and vector product of plane vectors. */
export const inner = (a, b) => a[0] * b[0] + a[1] * b[1];
export const across = (a, b) => a[0] * b[1] - a[1] * b[0];
export const divided = (a, b) => scaled(1 / inner(b, b), multiplied(a, conj(b)));

/** Values of a polynomial with coefficients from the constant up, and of its derivative. */
function valued(coefficients, z) {
  let [value, slope] = [[0, 0], [0, 0]];
  for (let k = coefficients.length - 1; k >= 0; k -= 1) {
    slope = added(multiplied(slope, z), value);
    value = added(multiplied(value, z), [coefficients[k], 0]);
  }
  return [value, slope];
}

/** All complex roots of a real polynomial (Aberth's iteration); leading coefficients of no size are roots at infinity. */
export function roots(given) {
  const size = Math.max(...given.map(Math.abs)), coefficients = [...given];
  while (coefficients.length > 1 && Math.abs(coefficients[coefficients.length - 1]) <= 1e-14 * size) coefficients.pop();
  const n = coefficients.length - 1;
  if (n < 1) return [];
  const lead = Math.abs(coefficients[n]);
  const radius = Math.max(...coefficients.slice(0, n).map((c, k) => (Math.abs(c) / lead) ** (1 / (n - k)))) || 1;
  const all = Array.from({ length: n }, (_, k) => scaled(radius, direction((FULL_TURN * k) / n + 0.4)));
  for (let round = 0; round < 200; round += 1) {
    let moved = 0;
    for (let i = 0; i < n; i += 1) {
      const [value, slope] = valued(coefficients, all[i]);
      if (norm(value) === 0) continue;
      let apart = divided(slope, value); // 1 over Newton's step
      for (let j = 0; j < n; j += 1) if (j !== i) apart = minus(apart, divided([1, 0], minus(all[i], all[j])));
      const step = divided([1, 0], apart);
      if (!Number.isFinite(step[0] + step[1])) continue;
      all[i] = minus(all[i], step);
      moved = Math.max(moved, norm(step) / (norm(all[i]) + 1e-3 * radius));
    }
    if (moved < 1e-15) break;
  }
  return all;
}
