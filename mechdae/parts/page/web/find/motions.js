/** All linkages of two to five poses: dyads, pairs of them, the best first. */
import { added, direction, minus, norm, scaled } from "./complex.js";
import { circlePointOf, dyadCurve, displacementsOf, dyadsOfFive, moved, pivotOf, slidesOf } from "./dyads.js";
import { studied } from "./linkages.js";

/** How near in sizes of the task two linkages of a fan may be, and how long links may be in a fan. */
const ALIKE = 0.2, LONG_LINK = 5, SHORT_LINK = 0.04;

/** Middle and size of what poses are within. */
export function spreadOf(poses) {
  const middle = scaled(1 / poses.length, poses.reduce((sum, [x, y]) => added(sum, [x, y]), [0, 0]));
  return { middle, size: Math.max(...poses.map(([x, y]) => norm(minus([x, y], middle)))) || 1 };
}

const grid = (middle, size, n) => Array.from({ length: n * n }, (_, k) => added(middle, scaled((2 * size) / (n - 1), [(k % n) - (n - 1) / 2, Math.floor(k / n) - (n - 1) / 2])));

/** Dyads through the poses: all of four and five, of fewer those of chosen pivots or of a grid. @param {number[][]} poses @param {number[][]} pivots */
export function dyadsOf(poses, pivots = []) {
  const displacements = displacementsOf(poses), { middle, size } = spreadOf(poses);
  const good = (dyad) => dyad.z && (dyad.m || dyad.slide);
  if (poses.length === 5) return dyadsOfFive(displacements);
  if (poses.length === 4) return [...dyadCurve(displacements), ...slidesOf(displacements)];
  const ofPivot = (m) => (poses.length === 3 ? [{ z: circlePointOf(displacements, m), m }]
    : Array.from({ length: 8 }, (_, k) => ({ z: circlePointOf(displacements, m, added(middle, scaled(size, direction((k * Math.PI) / 4)))), m })));
  if (pivots.length) return pivots.flatMap(ofPivot).filter(good);
  const points = grid([poses[0][0], poses[0][1]], 1.2 * size, 7);
  if (poses.length === 3) return [...grid(middle, 2 * size, 9).flatMap(ofPivot), ...points.map((z) => ({ z, m: pivotOf(displacements, z) })), ...slidesOf(displacements)].filter(good);
  const turned = points.flatMap((z) => [0, 2, 4, 6].map((k) => ({ z, m: pivotOf(displacements, z, added(middle, scaled(1.5 * size, direction((k * Math.PI) / 4)))) })));
  const slid = points.map((z) => { const way = minus(moved(displacements[0], z), z); return { z, m: null, slide: norm(way) > 0 ? scaled(1 / norm(way), way) : null }; });
  return [...turned, ...slid].filter(good);
}

/** A linkage of two dyads, the better of both ways to drive it; null of one that is none. */
export function linkageOf(one, two, poses, displacements = displacementsOf(poses)) {
  const { size } = spreadOf(poses), ways = [];
  if (norm(minus(one.z, two.z)) < 1e-6 * size || (one.m && two.m && norm(minus(one.m, two.m)) < 1e-6 * size)) return null;
  for (const [first, second] of [[one, two], [two, one]]) {
    if (!first.m || norm(minus(first.z, first.m)) < 1e-6 * size) continue;
    const facts = studied(first, second, displacements);
    const lengths = Object.values(facts.lengths).filter((v) => v > 0);
    const fit = Math.min(...lengths) > SHORT_LINK * size && Math.max(...lengths) < LONG_LINK * size ? 1 : 0;
    ways.push({ first, second, facts, worth: 8 * Number(facts.branch) + 4 * Number(facts.order) + 2 * fit + Number(facts.full) / 2 + facts.angle });
  }
  return ways.sort((a, b) => b.worth - a.worth)[0] || null;
}

/** How far two linkages differ, in sizes of the task. */
function difference(one, two) {
  const places = ({ first, second }) => [first.z, first.m, second.z, second.m || second.slide];
  const [p, q] = [places(one), places(two)];
  const far = (a, b) => Math.max(...a.map((place, k) => norm(minus(place, b[k]))));
  return Math.min(far(p, q), far(p, [q[2], q[3], q[0], q[1]]));
}

/** The best linkages through the poses, unlike each other; of five poses all. `passed`: how many pairs do not meet them on one branch. */
export function motionsOf(poses, pivots = [], many = 12) {
  const displacements = displacementsOf(poses), { size } = spreadOf(poses), dyads = dyadsOf(poses, pivots);
  const step = Math.max(1, Math.ceil(dyads.length / 120)), some = dyads.filter((_, k) => k % step === 0 || k >= dyads.length - 1);
  const chosen = pivots.length === 2 && poses.length < 4;
  const pairs = some.flatMap((one, i) => some.slice(0, i).map((two) => (chosen && one.m === two.m ? null : linkageOf(one, two, poses, displacements)))).filter(Boolean);
  pairs.sort((a, b) => b.worth - a.worth);
  const found = [], all = poses.length === 5 || chosen;
  for (const own of pairs) {
    if (found.length === many) break;
    if (!all && found.length && !own.facts.branch) break;
    if (all || !found.some((known) => difference(own, known) < ALIKE * size)) found.push(own);
  }
  return { dyads, found, passed: pairs.filter(({ facts }) => !facts.branch).length };
}
