/** Dyads of poses in closed form: points of a body that keep their distance from a pivot, or stay on a line, in two to five poses (Burmester).
 * A pose is [x, y, angle]; points of the body are given where they are in the first pose. */
import { across, added, conj, direction, divided, inner, minus, multiplied, norm, roots, scaled } from "./complex.js";

const NONE = 1e-9;

/** Displacements from the first pose to the others: z goes to a z + b. */
export function displacementsOf(poses) {
  const [[x, y, angle]] = poses;
  return poses.slice(1).map(([u, v, turned]) => {
    const a = direction(turned - angle);
    return { a, b: minus([u, v], multiplied(a, [x, y])) };
  });
}

export const moved = ({ a, b }, z) => added(multiplied(a, z), b);

/** That z keeps its distance from m is w . m + k = 0, linear in the pivot. */
function pivotRow({ a, b }, z) {
  const w = minus(minus(z, multiplied(a, z)), b);
  return [w[0], w[1], inner(b, b) / 2 + inner(multiplied(a, z), b)];
}

/** The same linear in the circle point. */
function pointRow({ a, b }, m) {
  const g = added(minus(m, multiplied(conj(a), m)), multiplied(conj(a), b));
  return [g[0], g[1], inner(b, b) / 2 - inner(b, m)];
}

/** The place that two rows determine, or null. */
function crossing([p, q, r], [s, t, u]) {
  const det = p * t - q * s;
  if (Math.abs(det) <= NONE * Math.hypot(p, q) * Math.hypot(s, t)) return null;
  return [(q * u - r * t) / det, (r * s - p * u) / det];
}

/** The place that rows leave: of one row the one on its line that is nearest to `near`, of more that of the two that cross best. */
function placed(rows, near) {
  if (rows.length === 1) {
    const [p, q, r] = rows[0], long = p * p + q * q;
    return long > 0 ? minus(near, scaled((p * near[0] + q * near[1] + r) / long, [p, q])) : near;
  }
  let best = null, sine = NONE;
  rows.forEach((one, i) => rows.slice(0, i).forEach((two) => {
    const own = Math.abs(across(one, two)) / (Math.hypot(one[0], one[1]) * Math.hypot(two[0], two[1]) || 1);
    if (own > sine) [best, sine] = [crossing(one, two), own];
  }));
  return best;
}

/** The pivot of a circle point; of two poses the one nearest to `near`. */
export const pivotOf = (displacements, z, near = z) => placed(displacements.map((own) => pivotRow(own, z)), near);

/** The circle point of a pivot, of two or three poses; of two the one nearest to `near`. */
export const circlePointOf = (displacements, m, near = m) => placed(displacements.map((own) => pointRow(own, m)), near);

/** The pole of a displacement: the point that it leaves where it is. */
const poleOf = ({ a, b }) => divided(b, minus([1, 0], a));

/** The displacement that turns most, first. */
function turning(displacements) {
  const most = displacements.reduce((best, own) => (own.a[0] < best.a[0] ? own : best));
  return 1 - most.a[0] > NONE ? [most, ...displacements.filter((own) => own !== most)] : null;
}

/** Circle points of four poses on the line through a pole: at most two. The determinant of the rows is a cubic along it, of which the pole is a root. */
export function dyadsAlong(displacements, angle) {
  const order = turning(displacements);
  if (!order) return [];
  const pole = poleOf(order[0]), way = direction(angle);
  const [first, second, third] = order.map((own) => {
    const at = pivotRow(own, pole), then = pivotRow(own, added(pole, way));
    return at.map((value, k) => [value, then[k] - value]);
  });
  const det = (t) => {
    const [p, q, r] = first.map(([, slope]) => slope), [s, u] = [second, third].map((row) => row.map(([value, slope]) => value + t * slope));
    return p * (s[1] * u[2] - s[2] * u[1]) - q * (s[0] * u[2] - s[2] * u[0]) + r * (s[0] * u[1] - s[1] * u[0]);
  };
  const size = Math.max(...displacements.map(({ b }) => norm(b))) || 1;
  const [low, middle, high] = [det(-size), det(0), det(size)];
  const [A, B] = [(low + high) / 2 - middle, (high - low) / 2], D = B * B - 4 * A * middle;
  if (D < 0) return [];
  const q = -(B + Math.sign(B || 1) * Math.sqrt(D)) / 2;
  return [q / A, middle / q].filter(Number.isFinite).map((t) => {
    const z = added(pole, scaled(t * size, way));
    return { z, m: pivotOf(displacements, z), along: angle };
  }).filter(({ m }) => m);
}

/** Burmester's curves of four poses as dyads along a pencil of lines. */
export function dyadCurve(displacements, count = 360) {
  return Array.from({ length: count }, (_, k) => dyadsAlong(displacements, (Math.PI * (k + 0.5)) / count)).flat();
}

/** Coefficients of a conic from its values at six places: 1, x, y, x^2, xy, y^2. */
function conicOf(value) {
  const c = value(0, 0), [px, mx, py, my] = [value(1, 0), value(-1, 0), value(0, 1), value(0, -1)];
  const [xx, yy] = [(px + mx) / 2 - c, (py + my) / 2 - c], [x, y] = [(px - mx) / 2, (py - my) / 2];
  return [c, x, y, xx, value(1, 1) - c - x - y - xx - yy, yy];
}

const polyTimes = (p, q) => { const found = new Array(p.length + q.length - 1).fill(0); p.forEach((a, i) => q.forEach((b, j) => { found[i + j] += a * b; })); return found; };
const polyLess = (p, q) => Array.from({ length: Math.max(p.length, q.length) }, (_, k) => (p[k] || 0) - (q[k] || 0));

/** Real places that two conics share. */
function shared(one, two) {
  const turn = direction(0.6180339887); // no two places above each other
  const turnedOf = (conic) => conicOf((x, y) => { const [u, v] = multiplied(turn, [x, y]); return conic[0] + conic[1] * u + conic[2] * v + conic[3] * u * u + conic[4] * u * v + conic[5] * v * v; });
  const sides = [one, two].map(turnedOf).map((own) => { const size = Math.max(...own.map(Math.abs)); return own.map((v) => v / size); });
  const [[a, b, c], [d, e, f]] = sides.map(([k, x, y, xx, xy, yy]) => [[yy], [y, xy], [k, x, xx]]); // powers of y
  const [ae, af, bf] = [polyLess(polyTimes(a, e), polyTimes(b, d)), polyLess(polyTimes(a, f), polyTimes(c, d)), polyLess(polyTimes(b, f), polyTimes(c, e))];
  const quartic = polyLess(polyTimes(af, af), polyTimes(ae, bf));
  const at = (poly, z) => poly.reduceRight((sum, k) => added(multiplied(sum, z), [k, 0]), [0, 0]);
  const found = [];
  for (const x of roots(quartic)) {
    const [up, down] = [at(af, x), at(ae, x)];
    if (norm(down) === 0) continue;
    const y = scaled(-1, divided(up, down));
    let place = [x[0], y[0]], step = [1, 1];
    for (let round = 0; round < 12; round += 1) { // Newton's method from the real parts: a complex pair has no zero there
      const rows = sides.map((own) => {
        const [u, v] = place, [k, lx, ly, xx, xy, yy] = own;
        return [lx + 2 * xx * u + xy * v, ly + xy * u + 2 * yy * v, k + lx * u + ly * v + xx * u * u + xy * u * v + yy * v * v];
      });
      step = crossing(rows[0], rows[1]);
      if (!step) break;
      place = added(place, step);
    }
    const far = 1 + norm(place);
    if (!step || !(norm(step) < 1e-9 * far) || Math.hypot(place[0] - x[0], x[1], place[1] - y[0], y[1]) > 1e-4 * far) continue;
    if (!found.some((own) => norm(minus(own, place)) < 1e-7 * far)) found.push(place);
  }
  return found.map((place) => multiplied(turn, place));
}

/** Dyads of five poses: at most four. All rows have the terms xu + yv and xv - yu; without these two of them are linear in x, y, u, v, which leaves two conics. */
export function dyadsOfFive(displacements) {
  const size = Math.max(...displacements.map(({ b }) => norm(b))) || 1;
  const rows = displacements.map(({ a, b: whole }) => {
    const b = scaled(1 / size, whole), back = multiplied(conj(a), b);
    return [1 - a[0], a[1], back[0], back[1], -b[0], -b[1], inner(b, b) / 2]; // xu + yv, yu - xv turned by sign, x, y, u, v, 1
  });
  // Gauss-Jordan: the two products, then two of x, y, u, v
  const pivots = [];
  for (const columns of [[0, 1], [0, 1], [2, 3, 4, 5], [2, 3, 4, 5]]) {
    let best = 0, at = null;
    for (let i = pivots.length; i < 4; i += 1) for (const j of columns) if (!pivots.includes(j) && Math.abs(rows[i][j]) > best) [best, at] = [Math.abs(rows[i][j]), [i, j]];
    if (!at || best < NONE) return [];
    const [i, j] = at, k = pivots.length;
    [rows[k], rows[i]] = [rows[i], rows[k]];
    rows[k] = rows[k].map((value) => value / rows[k][j]);
    rows.forEach((row, other) => { if (other !== k) rows[other] = row.map((value, n) => (n === j ? 0 : value - row[j] * rows[k][n])); });
    pivots.push(j);
  }
  const free = [2, 3, 4, 5].filter((j) => !pivots.includes(j));
  const whole = (s, t) => {
    const own = [0, 0, 0, 0, 0, 0, 1];
    [own[free[0]], own[free[1]]] = [s, t];
    for (const k of [2, 3]) own[pivots[k]] = -(rows[k][free[0]] * s + rows[k][free[1]] * t + rows[k][6]);
    return own;
  };
  const conics = [0, 1].map((k) => conicOf((s, t) => {
    const [, , x, y, u, v] = whole(s, t), parts = [x * u + y * v, y * u - x * v];
    return parts[pivots[k]] + [2, 3, 4, 5, 6].reduce((sum, j) => sum + rows[k][j] * whole(s, t)[j], 0);
  }));
  return shared(conics[0], conics[1]).map(([s, t]) => {
    const [, , x, y, u, v] = whole(s, t);
    return { z: [size * x, size * y], m: [size * u, size * v] };
  });
}


/** Points of the body that lie on a line in all poses, with its direction: of two poses all points, of three those of a circle, of four one point.
 * A line through a pole meets the circle of three poses once more; of four poses two such circles share a pole and one point more. */
export function slidesOf(displacements, count = 24) {
  const order = turning(displacements);
  if (!order || displacements.length < 2 || displacements.length > 3) return [];
  const pole = poleOf(order[0]);
  const circle = (one, two) => { // z for which the ways to both later places are parallel
    const f = (z) => across(minus(moved(one, z), z), minus(moved(two, z), z));
    const [c, x, y, xx] = conicOf((u, v) => f([u, v]));
    return [c, x, y, xx]; // c + x u + y v + xx (u^2 + v^2)
  };
  const slid = (z) => { const way = order.map((own) => minus(moved(own, z), z)).reduce((a, b) => (norm(b) > norm(a) ? b : a)); return { z, m: null, slide: scaled(1 / norm(way), way) }; };
  if (displacements.length === 2) {
    const [, x, y, xx] = circle(order[0], order[1]);
    return Array.from({ length: count }, (_, k) => {
      const way = direction((Math.PI * (k + 0.5)) / count);
      const t = -(x * way[0] + y * way[1] + 2 * xx * inner(pole, way)) / xx;
      return Number.isFinite(t) ? slid(added(pole, scaled(t, way))) : null;
    }).filter(Boolean);
  }
  const [one, two] = [circle(order[0], order[1]), circle(order[0], order[2])];
  const line = [1, 2].map((k) => one[k] * two[3] - two[k] * one[3]); // both circles less the squares: the line through what they share
  const way = [-line[1], line[0]];
  if (!(norm(way) > 0)) return [];
  const round = Math.abs(one[3]) > Math.abs(two[3]) ? one : two;
  const t = -(round[1] * way[0] + round[2] * way[1] + 2 * round[3] * inner(pole, way)) / (round[3] * inner(way, way));
  return Number.isFinite(t) ? [slid(added(pole, scaled(t, way)))] : [];
}
