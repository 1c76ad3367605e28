/** What was found as drawings of the editor. */
import { across, added, direction, minus, multiplied, norm, scaled } from "./complex.js";
import { around, FAMILIES } from "./families.js";
import { classOf } from "./linkages.js";

/** A drawing: places by name, links by the names of their points, what is fixed or slides, gears between two links; the first link is driven. */
function drawing(places, links, fixed, { slides = {}, gears = [] } = {}) {
  const names = Object.keys(places), id = (name) => 1 + names.indexOf(name);
  const nodes = names.map((name) => ({ id: id(name), name, x: places[name][0], y: places[name][1], fixed: fixed.includes(name), slide: name in slides ? { angle: slides[name] } : null }));
  const made = Object.entries(links).map(([name, points], k) => ({ id: names.length + 1 + k, name, nodes: points.map(id) }));
  return { nodes, links: made, gears, driver: { link: made[0].id } };
}

/** A linkage of two dyads in the first pose, with the origin of the body. */
export function ofPoses({ first, second }, [[x, y]]) {
  const places = { A0: first.m, A: first.z, B: second.z, P: [x, y] }, links = { crank: ["A0", "A"], coupler: ["A", "B", "P"] };
  const on = ["A", "B"].find((name) => norm(minus(places[name], [x, y])) < 1e-9 * norm(minus(first.z, second.z)));
  if (on) { delete places.P; links.coupler.pop(); } // the body's origin is a pin
  if (!second.m) return drawing(places, links, ["A0"], { slides: { B: Math.atan2(second.slide[1], second.slide[0]) } });
  places.B0 = second.m;
  return drawing(places, { ...links, rocker: ["B", "B0"] }, ["A0", "B0"]);
}

/** Joints of a mechanism of the atlas in its own frame at a value of its driver, by name, and pin u and direction v of the body that traces; null where it does not assemble.
 * `corners`: ends of two bars about their pin, which transmit forces at their angle. */
function jointsOf({ family, y }, tau) {
  const { name, trace, whole, ratio } = FAMILIES[family], x = y.subarray(6), [bar, rocker, ground, first] = [x[0], x[1], x[2], x[7]].map(Math.exp);
  const traced = (own) => { const [U, V] = [new Float64Array(2), new Float64Array(2)]; return own(x, Float64Array.of(tau), U, V) && [[...U], [...V]]; };
  const body = traced(trace);
  if (!body) return null;
  const [u, v] = body, B0 = [ground, 0];
  if (ratio) {
    const C = added(u, scaled(bar, v)), B = added(B0, scaled(Math.exp(x[3]), direction(ratio * tau + x[4])));
    return { joints: { A0: [0, 0], A: u, C, B, B0 }, u, v, corners: [[u, C, B]] };
  }
  const [A, way] = name === "slider-crank" ? body : traced(FAMILIES[whole ? 0 : 1].trace), joints = { A0: [0, 0], A, B: added(A, scaled(bar, way)) };
  if (name === "slider-crank") return { joints, u, v, corners: [[A, joints.B, added(joints.B, [0, 1])]] };
  joints.B0 = B0;
  const corners = [[A, joints.B, B0]];
  if (x.length < 9) return { joints, u, v, corners };
  const E = name === "watt" ? added(joints.B0, multiplied([x[5], x[6]], scaled(1 / rocker, minus(joints.B, joints.B0)))) : [x[5], x[6]];
  const D = added(u, scaled(first, v));
  return { joints: { ...joints, C: u, D, E }, u, v, corners: [...corners, [u, D, E]] };
}

/** A mechanism of the atlas at a value of its driver; `centre` and `size` bring places of a fit to where they are wanted. */
export function ofCurve(solution, tau, { centre, size }) {
  const { family, y, mirror } = solution, { name, ratio } = FAMILIES[family], found = jointsOf(solution, tau);
  if (!found) return null;
  const { joints, u, v } = found, [o, p, q] = [[y[0], y[1]], [y[2], y[3]], [y[4], y[5]]];
  const seen = ([a, b]) => [centre[0] + size * a, centre[1] + size * (mirror ? -b : b)];
  const places = Object.fromEntries(Object.entries(joints).map(([key, place]) => [key, seen(added(o, multiplied(p, place)))]));
  places.P = seen(added(added(o, multiplied(p, u)), multiplied(q, v)));
  if (name === "slider-crank") return drawing(places, { crank: ["A0", "A"], coupler: ["A", "B", "P"] }, ["A0"], { slides: { B: (mirror ? -1 : 1) * Math.atan2(p[1], p[0]) } });
  if (ratio) return drawing(places, { crank: ["A0", "A"], coupler: ["A", "C", "P"], rod: ["C", "B"], second: ["B0", "B"] }, ["A0", "B0"], { gears: [["second", "crank", ratio]] });
  if (!joints.E) return drawing(places, { crank: ["A0", "A"], coupler: ["A", "B", "P"], rocker: ["B", "B0"] }, ["A0", "B0"]);
  const links = { crank: ["A0", "A"], coupler: ["A", "B", "C"], rocker: name === "watt" ? ["B", "B0", "E"] : ["B", "B0"], tracer: ["C", "D", "P"], bar: ["D", "E"] };
  return drawing(places, links, name === "watt" ? ["A0", "B0"] : ["A0", "B0", "E"]);
}

/** Values of the driver from which each branch is followed: the middle of a full turn, or one on either side between limits. */
export const beginnings = ({ family }) => (FAMILIES[family].whole ? [0] : [0.3, Math.PI + 0.3]);

/** Class of a mechanism of the atlas, and its worst transmission angle over the motion: 0 where its driver cannot turn through. */
export function factsOf(solution) {
  const { name, whole, ratio } = FAMILIES[solution.family], [bar, rocker, ground] = solution.y.subarray(6, 9).map(Math.exp);
  const sine = (a, b, c) => Math.abs(across(minus(b, a), minus(c, b))) / (norm(minus(b, a)) * norm(minus(c, b)));
  const sines = Array.from(around(90), (tau) => {
    const found = jointsOf(solution, tau);
    if (!found) return 0;
    return Math.min(...found.corners.map((own) => sine(...own)));
  });
  return { class: ["four-bar", "rocker"].includes(name) ? classOf(1, bar, rocker, ground) : name, ratio, full: whole, angle: Math.asin(Math.min(1, ...sines)) };
}
