/** What is sought as a problem file for `mechdae synthesize`: a four-bar to begin with, its dimensions free, the goal. */
import { direction, minus, multiplied, norm } from "./complex.js";
import { spreadOf } from "./motions.js";

const DIMENSIONS = ["ax", "ay", "bx", "by", "ux", "uy", "vx", "vy", "la", "lb"];
const row = (values) => `[${values.map((v) => String(Number(v.toPrecision(12)))).join(", ")}]`;

/** The four-bar of a drawing, or one of about the size of the task: pivots, pins of the coupler. */
function begun(drawing, middle, size) {
  const places = drawing && Object.fromEntries(drawing.nodes.map(({ name, x, y }) => [name, [x, y]]));
  if (places && places.B0 && drawing.links.length === 3) return places;
  const at = ([x, y]) => [middle[0] + size * x, middle[1] + size * y];
  return { A0: at([-1, -1.5]), A: at([-0.6, -0.6]), B: at([1, 0]), B0: at([1.5, -1.5]) };
}

/** @param {{ poses?: number[][], points?: number[][], closed?: boolean }} task @param {any} drawing a linkage to begin with, or null */
export function taskText({ poses, points, closed }, drawing) {
  const places = poses || points.map(([x, y]) => [x, y, 0]), { middle, size } = spreadOf(places);
  const four = begun(drawing, middle, size), P = drawing && drawing.nodes.find(({ name }) => name === "P");
  const origin = poses ? [poses[0][0], poses[0][1]] : P && four.P ? [P.x, P.y] : [places[0][0], places[0][1]];
  const turn = poses ? poses[0][2] : Math.atan2(four.B[1] - four.A[1], four.B[0] - four.A[0]);
  const inside = (place) => multiplied(direction(-turn), minus(place, origin));
  const [u, v] = [inside(four.A), inside(four.B)], lengths = [norm(minus(four.A, four.A0)), norm(minus(four.B, four.B0))];
  const values = [...four.A0, ...four.B0, ...u, ...v, ...lengths];
  const reach = 8 * Math.max(size, ...lengths, ...[four.A0, four.B0].map((place) => norm(minus(place, middle))));
  const bounds = (name, k) => (name[0] === "l" ? [size / 50, reach] : k < 4 ? [middle[k % 2] - reach, middle[k % 2] + reach] : [-reach, reach]);
  const angle = (from, to) => String(Math.atan2(to[1] - from[1], to[0] - from[0]));
  const goal = poses
    ? ['kind = "motion"', 'body = "coupler"', `timing = "${poses.length > 3 ? "any" : "free"}"`, 'measure = "exact"', `poses = [${poses.map(row).join(", ")}]`]
    : ['kind = "path"', 'point = "coupler.P"', 'timing = "free"', ...(closed ? ["closed = true"] : []), `targets = [${points.map(row).join(", ")}]`];
  return `${["schema = 1", 'title = "Linkage that is sought"', "", "[parameters]", ...DIMENSIONS.map((name, k) => `${name} = ${values[k]}`), "",
    "[ground]", 'points = { A0 = ["ax", "ay"], B0 = ["bx", "by"] }', "",
    "[bodies.crank]", 'points = { A0 = [0, 0], A = ["la", 0] }', "",
    "[bodies.coupler]", 'points = { P = [0, 0], A = ["ux", "uy"], B = ["vx", "vy"] }', "",
    "[bodies.rocker]", 'points = { B0 = [0, 0], B = ["lb", 0] }', "", "[joints]",
    ...[["A0", "ground", "crank"], ["A", "crank", "coupler"], ["B", "coupler", "rocker"], ["B0", "ground", "rocker"]].map(([name, a, b]) => `${name} = { kind = "revolute", between = ["${a}.${name}", "${b}.${name}"] }`), "",
    "[sketch]", `crank = ${angle(four.A0, four.A)}`, `coupler = ${turn}`, `rocker = ${angle(four.B0, four.B)}`, "",
    "[tasks.turn]", 'kind = "sweep"', 'driver = { coordinate = "A0.angle", range = "assembled" }', "poses = 361", "",
    "[tasks.design]", 'kind = "synthesis"', 'driver = { coordinate = "A0.angle" }', "starts = 40", "seed = 0", "",
    "[tasks.design.free]", ...DIMENSIONS.map((name, k) => `${name} = ${row(bounds(name, k))}`), "",
    "[tasks.design.goal]", ...goal].join("\n")}\n`;
}
