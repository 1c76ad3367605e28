/** Vectors of any length, of the plane, of three numbers. */
export const sum = (...all) => all[0].map((_, k) => all.reduce((total, own) => total + own[k], 0));
export const subtracted = (one, two) => one.map((value, k) => value - two[k]);
export const moment = ([x, y], [fx, fy]) => x * fy - y * fx;
export const dot = (one, two) => one.reduce((total, value, k) => total + value * two[k], 0);
export const along3 = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const plus = (a, b, k = 1) => [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]];
export const times = (a, k) => [a[0] * k, a[1] * k, a[2] * k];
export const outer = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const unit3 = (a) => { const size = Math.hypot(...a); return size > 0 ? times(a, 1 / size) : a; };
export const across3 = (axis) => {
  const k = axis.reduce((best, v, i) => (Math.abs(v) < Math.abs(axis[best]) ? i : best), 0);
  const first = unit3(outer(axis, [0, 1, 2].map((i) => (i === k ? 1 : 0))));
  return [first, outer(axis, first)];
};
