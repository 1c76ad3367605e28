/** A wanted curve: closed, resampled by length of arc. */

/** Quicker than Math.hypot. */
export const lengthOf = (x, y) => Math.sqrt(x * x + y * y);

/** n places at equal lengths of arc along a polyline (x, y, ...) of m places; closed, or with its ends. */
export function resampled(z, m, n, closed = true) {
  const ends = closed ? m : m - 1, far = new Float64Array(ends + 1);
  const next = (k) => (k + 1) % m;
  for (let k = 0; k < ends; k += 1) far[k + 1] = far[k] + lengthOf(z[2 * next(k)] - z[2 * k], z[2 * next(k) + 1] - z[2 * k + 1]);
  const found = new Float64Array(2 * n), shares = new Float64Array(n);
  for (let i = 0, k = 0; i < n; i += 1) {
    const at = (far[ends] * i) / (closed ? n : n - 1);
    while (k < ends - 1 && far[k + 1] < at) k += 1;
    const t = far[k + 1] > far[k] ? (at - far[k]) / (far[k + 1] - far[k]) : 0;
    found[2 * i] = z[2 * k] + t * (z[2 * next(k)] - z[2 * k]);
    found[2 * i + 1] = z[2 * k + 1] + t * (z[2 * next(k) + 1] - z[2 * k + 1]);
    shares[i] = (k + t) / m;
  }
  return { places: found, shares };
}

/** A closed smooth curve through places, in their order (centripetal Catmull-Rom). */
export function smoothThrough(points, each = 24) {
  const n = points.length, found = [];
  const at = (k) => points[(k + n) % n], knot = (a, b) => Math.max(1e-12, Math.sqrt(Math.hypot(a[0] - b[0], a[1] - b[1])));
  for (let k = 0; k < n; k += 1) {
    const P = [at(k - 1), at(k), at(k + 1), at(k + 2)], t = [0];
    for (let i = 0; i < 3; i += 1) t.push(t[i] + knot(P[i], P[i + 1]));
    for (let j = 0; j < each; j += 1) {
      const s = t[1] + ((t[2] - t[1]) * j) / each;
      const mix = (a, b, from, to) => a.map((v, i) => ((to - s) * v + (s - from) * b[i]) / (to - from));
      const A = [0, 1, 2].map((i) => mix(P[i], P[i + 1], t[i], t[i + 1]));
      const B = [0, 1].map((i) => mix(A[i], A[i + 1], t[i], t[i + 2]));
      found.push(...mix(B[0], B[1], t[1], t[2]));
    }
  }
  return Float64Array.from(found);
}

/** Centre and root of the mean square distance from it. */
export function measured(z) {
  const n = z.length / 2;
  let [x, y, r] = [0, 0, 0];
  for (let k = 0; k < n; k += 1) { x += z[2 * k] / n; y += z[2 * k + 1] / n; }
  for (let k = 0; k < n; k += 1) r += ((z[2 * k] - x) ** 2 + (z[2 * k + 1] - y) ** 2) / n;
  return { centre: [x, y], size: Math.sqrt(r) };
}

/** The larger side of the box around places: the size that errors are shares of. */
export function extent(z) {
  let [left, right, low, high] = [Infinity, -Infinity, Infinity, -Infinity];
  for (let k = 0; k < z.length; k += 2) {
    left = Math.min(left, z[k]); right = Math.max(right, z[k]);
    low = Math.min(low, z[k + 1]); high = Math.max(high, z[k + 1]);
  }
  return Math.max(right - left, high - low);
}

/** The greatest distance of the places of one polyline from another, closed one. */
export function beyond(z, w) {
  let worst = 0;
  const n = w.length / 2;
  for (let k = 0; k < z.length; k += 2) {
    let least = Infinity;
    for (let i = 0, j = n - 1; i < n; j = i, i += 1) {
      const [ax, ay] = [w[2 * j], w[2 * j + 1]], [dx, dy] = [w[2 * i] - ax, w[2 * i + 1] - ay], [px, py] = [z[k] - ax, z[k + 1] - ay];
      const t = Math.max(0, Math.min(1, (px * dx + py * dy) / (dx * dx + dy * dy || 1)));
      least = Math.min(least, (px - t * dx) ** 2 + (py - t * dy) ** 2);
    }
    worst = Math.max(worst, least);
  }
  return Math.sqrt(worst);
}

/** Hausdorff's distance of two closed curves. */
export const hausdorff = (z, w) => Math.max(beyond(z, w), beyond(w, z));
