/** What was found, followed by the page's solver: that it closes, and that it does what was asked for. */
import { textOf, UNITS } from "../edit/given.js";
import { Sketch } from "../edit/sketch.js";
import { trialOf } from "../edit/trial.js";
import { angleOf, minus, norm } from "./complex.js";
import { FULL_TURN } from "../way.js";
import { displacementsOf, moved } from "./dyads.js";
import { beginnings, ofCurve } from "./drawn.js";
import { beyond, extent, hausdorff } from "./targets.js";

/** The followed motion of a drawing: the page's session, or null. */
function followed(drawing) {
  const { session } = trialOf(new Sketch(textOf(drawing, "followed"), UNITS));
  return session;
}

/** The greatest distance of the pins from where the poses have them, in metres, met along one motion; null where a pose is not on its way. */
export function missOfPoses(drawing, { first, second, facts }, poses) {
  const run = followed(drawing);
  if (!run) return null;
  const displacements = displacementsOf(poses), [low, high] = run.range;
  let worst = 0;
  for (let k = 0; k < poses.length; k += 1) {
    const place = (z) => (k ? moved(displacements[k - 1], z) : z);
    const turn = angleOf(minus(place(first.z), first.m));
    const u = [-1, 0, 1].map((n) => turn + n * FULL_TURN).find((value) => value >= low - 1e-9 && value <= high + 1e-9);
    const pose = u !== undefined && run.motion.pose(u);
    if (!pose || pose.status !== "ok") return null;
    const own = run.places_of(pose);
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
    const { id } = drawing.nodes.find(({ name }) => name === "P"), link = drawing.links.find(({ nodes }) => nodes.includes(id)).name;
    const places = run.poses.filter(({ y }) => y).map((pose) => run.places_of(pose)[`${link}.P`]);
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
