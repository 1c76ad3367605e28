/** What was found, followed by the page's solver: that it closes, and that it does what was asked for. */
import { Draft } from "../draft.js";
import { angleOf, minus, norm, FULL_TURN } from "./complex.js";
import { displacementsOf, moved } from "./dyads.js";
import { beginnings, ofCurve } from "./drawn.js";
import { beyond, extent, hausdorff } from "./targets.js";


/** The followed motion of a drawing: places of a node of each pose, or null. */
function followed(drawing) {
  const draft = new Draft(drawing), { count, rank } = draft.check();
  const swept = count === 1 && rank === 1 ? draft.sweep() : null;
  return swept && { draft, swept };
}

/** The greatest distance of the pins from where the poses have them, in metres, met along one motion; null where a pose is not on its way. */
export function missOfPoses(drawing, { first, second, facts }, poses) {
  const run = followed(drawing);
  if (!run) return null;
  const { draft, swept } = run, displacements = displacementsOf(poses);
  let worst = 0;
  for (let k = 0; k < poses.length; k += 1) {
    const place = (z) => (k ? moved(displacements[k - 1], z) : z);
    const turn = angleOf(minus(place(first.z), first.m));
    const { poses: all } = swept, u = [-1, 0, 1].map((n) => turn + n * FULL_TURN).find((value) => value >= all[0].u - 1e-9 && value <= all[all.length - 1].u + 1e-9);
    if (u === undefined) return null;
    const near = all.reduce((best, own) => (Math.abs(own.u - u) < Math.abs(best.u - u) ? own : best));
    const solved = draft.solve(near.q, u);
    if (!solved) return null;
    const own = draft.places(solved.q);
    worst = Math.max(worst, norm(minus(own["coupler.A"], place(first.z))), norm(minus(own["coupler.B"], place(second.z))));
  }
  return facts.branch ? worst : null;
}

/** The way of the tracing point, followed on each branch that the curve is on. */
export function tracedWay(solution, frame) {
  const way = [];
  for (const tau of beginnings(solution)) {
    const drawing = ofCurve(solution, tau, frame), run = drawing && followed(drawing);
    if (!run) return null;
    const link = drawing.links[drawing.links.length > 3 ? 3 : 1].name;
    const places = run.swept.poses.map(({ q }) => run.draft.places(q)[`${link}.P`]);
    way.push(...(way.length ? places.reverse() : places));
  }
  return Float64Array.from(way.flat());
}

/** How far the followed curve is from the one that is wanted, or how far it passes the points, as a share of their size. */
export function missOfCurve(solution, frame, wanted, points) {
  const way = tracedWay(solution, frame);
  if (!way) return null;
  if (!points) return { miss: hausdorff(way, wanted) / extent(wanted), way };
  const places = Float64Array.from(points.flat());
  return { miss: beyond(places, way) / extent(places), way };
}
