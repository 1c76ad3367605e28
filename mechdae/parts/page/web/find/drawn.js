/** What was found as drawings of the editor. */
import { FAMILIES } from "./families.js";
import { across, added, minus, multiplied, norm } from "./complex.js";
import { classOf } from "./linkages.js";

/** A drawing: places by name, links by the names of their points, what is fixed or slides; the first link is driven. */
function drawing(places, links, fixed, slides = {}) {
  const names = Object.keys(places), id = (name) => 1 + names.indexOf(name);
  const nodes = names.map((name) => ({ id: id(name), name, x: places[name][0], y: places[name][1], fixed: fixed.includes(name), slide: name in slides ? { angle: slides[name] } : null, slot: null, welds: [] }));
  const made = Object.entries(links).map(([name, points], k) => ({ id: names.length + 1 + k, name, nodes: points.map(id) }));
  return { nodes, links: made, bars: [], driver: { kind: "turn", link: made[0].id } };
}

/** A linkage of two dyads in the first pose, with the origin of the body. */
export function ofPoses({ first, second }, [[x, y]]) {
  const places = { A0: first.m, A: first.z, B: second.z, P: [x, y] }, links = { crank: ["A0", "A"], coupler: ["A", "B", "P"] };
  const on = ["A", "B"].find((name) => norm(minus(places[name], [x, y])) < 1e-9 * norm(minus(first.z, second.z)));
  if (on) { delete places.P; links.coupler.pop(); } // the body's origin is a pin
  if (!second.m) return drawing(places, links, ["A0"], { B: Math.atan2(second.slide[1], second.slide[0]) });
  places.B0 = second.m;
  return drawing(places, { ...links, rocker: ["B", "B0"] }, ["A0", "B0"]);
}

/** A mechanism of the atlas at a value of its driver; `seen` brings places of a fit to where they are wanted. */
export function ofCurve({ family, y, mirror }, tau, { centre, size }) {
  const { name, trace } = FAMILIES[family], x = y.subarray(6), [U, V] = [new Float64Array(2), new Float64Array(2)];
  if (!trace(x, Float64Array.of(tau), U, V)) return null;
  const [o, p, q] = [[y[0], y[1]], [y[2], y[3]], [y[4], y[5]]];
  const seen = ([u, v]) => [centre[0] + size * u, centre[1] + size * (mirror ? -v : v)], at = (place) => seen(added(o, multiplied(p, place)));
  const [bar, rocker, ground] = [Math.exp(x[0]), Math.exp(x[1]), Math.exp(x[2])];
  const P = seen(added(added(o, multiplied(p, [U[0], U[1]])), multiplied(q, [V[0], V[1]])));
  if (name === "slider-crank") {
    const turn = Math.atan2(p[1], p[0]), A = [U[0], U[1]];
    return drawing({ A0: at([0, 0]), A: at(A), B: at(added(A, [bar * V[0], bar * V[1]])), P }, { crank: ["A0", "A"], coupler: ["A", "B", "P"] }, ["A0"], { B: mirror ? -turn : turn });
  }
  const base = FAMILIES[name === "rocker" ? 1 : 0], [UA, VA] = [new Float64Array(2), new Float64Array(2)];
  base.trace(x, Float64Array.of(tau), UA, VA);
  const A = [UA[0], UA[1]], B = added(A, [bar * VA[0], bar * VA[1]]), B0 = [ground, 0];
  const places = { A0: at([0, 0]), A: at(A), B: at(B), B0: at(B0) };
  if (name === "four-bar" || name === "rocker") return drawing({ ...places, P }, { crank: ["A0", "A"], coupler: ["A", "B", "P"], rocker: ["B", "B0"] }, ["A0", "B0"]);
  const C = [U[0], U[1]], D = added(C, [Math.exp(x[7]) * V[0], Math.exp(x[7]) * V[1]]);
  const links = { crank: ["A0", "A"], coupler: ["A", "B", "C"], rocker: ["B", "B0"], tracer: ["C", "D", "P"], bar: ["D", "E"] };
  if (name === "stephenson") return drawing({ ...places, C: at(C), D: at(D), E: at([x[5], x[6]]), P }, links, ["A0", "B0", "E"]);
  const way = [(B[0] - ground) / rocker, B[1] / rocker], E = added(B0, multiplied([x[5], x[6]], way));
  return drawing({ ...places, C: at(C), D: at(D), E: at(E), P }, { ...links, rocker: ["B", "B0", "E"] }, ["A0", "B0"]);
}

/** Values of the driver from which each branch is followed: the middle of a full turn, or one on either side between limits. */
export const beginnings = ({ family }) => (FAMILIES[family].whole ? [0] : [0.3, Math.PI + 0.3]);

/** Class of a mechanism of the atlas, and its worst transmission angle over the motion. */
export function factsOf({ family, y }) {
  const { name, trace, whole } = FAMILIES[family], x = y.subarray(6), n = 90, tau = around(n), [U, V, UA, VA] = Array.from({ length: 4 }, () => new Float64Array(2 * n));
  trace(x, tau, U, V);
  const [bar, rocker, ground] = [Math.exp(x[0]), Math.exp(x[1]), Math.exp(x[2])], sines = [];
  if (name === "slider-crank") return { class: name, full: true, angle: Math.asin(Math.min(...Array.from({ length: n }, (_, k) => Math.abs(V[2 * k])))) };
  FAMILIES[whole ? 0 : 1].trace(x, tau, UA, VA);
  for (let k = 0; k < n; k += 1) {
    const A = [UA[2 * k], UA[2 * k + 1]], way = [VA[2 * k], VA[2 * k + 1]], B = added(A, [bar * way[0], bar * way[1]]);
    sines.push(Math.abs(across(way, [(B[0] - ground) / rocker, B[1] / rocker])));
    if (x.length < 9) continue;
    const [first, second] = [Math.exp(x[7]), Math.exp(x[8])], D = [U[2 * k] + first * V[2 * k], U[2 * k + 1] + first * V[2 * k + 1]];
    const E = name === "stephenson" ? [x[5], x[6]] : added([ground, 0], multiplied([x[5], x[6]], [(B[0] - ground) / rocker, B[1] / rocker]));
    sines.push(Math.abs(across([V[2 * k], V[2 * k + 1]], minus(E, D))) / second);
  }
  return { class: x.length < 9 ? classOf(1, bar, rocker, ground) : name, full: whole, angle: Math.asin(Math.min(1, ...sines)) };
}
