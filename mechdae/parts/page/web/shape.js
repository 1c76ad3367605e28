/** Joints and points pulled as dimensions: the numbers that place a point are changed until it is where the pointer is. */
import { nearing } from "./path.js";
import { pinned } from "./session.js";

const ROUNDS_OF_PULL = 12;
const NUDGE = 1e-6;

/** The sliders that place a point: those of all points that pins hold together there. */
export function slidersAt(data, reference) {
  const root = pinned(data.scene.joints);
  return [...new Set(Object.keys(data.shape).filter((name) => root(name) === root(reference)).flatMap((name) => data.shape[name]))];
}

/** Sliders that bring a point nearer to a place, the driver held; null where nothing places it. */
export function pulled(session, reference, [x, y]) {
  const { data, motion, pose } = session;
  const own = slidersAt(data, reference);
  if (!own.length || pose.status !== "ok") return null;
  const size = data.start.scale;
  const before = [...session.theta];
  let theta = [...before];
  let good = before;
  let from = pose.x;
  const placeAt = (values) => {
    motion.setNumbers(values);
    const found = motion.solved(pose.s, pose.place, from);
    const place = found.status === "ok" ? session.places_of(found)[reference] : null;
    return place && { place, x: found.x };
  };
  for (let round = 0; round < ROUNDS_OF_PULL; round += 1) {
    const here = placeAt(theta);
    if (!here) { // too far at once
      theta = theta.map((value, k) => (value + good[k]) / 2);
      continue;
    }
    good = theta;
    from = here.x;
    const gap = [x - here.place[0], y - here.place[1]];
    if (Math.hypot(...gap) < 1e-9 * size) break;
    const columns = own.map((k) => {
      const step = NUDGE * Math.max(Math.abs(theta[k]), size);
      const there = placeAt(theta.map((value, i) => (i === k ? value + step : value)));
      return there ? [(there.place[0] - here.place[0]) / step, (there.place[1] - here.place[1]) / step] : [0, 0];
    });
    const change = nearing(columns, gap, 1e-8);
    if (!change || !change.every(Number.isFinite)) break;
    const most = Math.max(...change.map(Math.abs));
    const share = most > 0.2 * size ? (0.2 * size) / most : 1;
    theta = theta.map((value, i) => (own.includes(i) ? value + share * change[own.indexOf(i)] : value));
  }
  motion.setNumbers(before);
  return theta.every(Number.isFinite) ? theta : null;
}
