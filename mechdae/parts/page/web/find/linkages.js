/** Four-bars and slider-cranks of two dyads: class, circuit, branch and order of poses, transmission angle. */
import { across, angleOf, inner, minus, norm } from "./complex.js";
import { FULL_TURN } from "../way.js";
import { moved } from "./dyads.js";

const wrapped = (angle) => angle - FULL_TURN * Math.round(angle / FULL_TURN);

/** Where low <= value + slope cos(turn) <= high: the middle of the arc, half of it (pi: everywhere), and whether there is a second arc, mirrored. */
export function arcWhere(low, high, value, slope) {
  const [least, most] = [(low - value) / slope, (high - value) / slope].sort((a, b) => a - b), [below, above] = [least <= -1, most >= 1];
  if (below && above) return { middle: 0, half: Math.PI, two: false };
  if (!below && !above) return { middle: (Math.acos(least) + Math.acos(most)) / 2, half: (Math.acos(least) - Math.acos(most)) / 2, two: true };
  return below ? { middle: Math.PI, half: Math.PI - Math.acos(most), two: false } : { middle: 0, half: Math.acos(least), two: false };
}

/** Where the driven link turns, by `arcWhere` about an axis: there the other dyad reaches the pin. */
function arcOf({ m, z }, other) {
  const crank = norm(minus(z, m)), bar = norm(minus(other.z, z));
  let [low, high, value, slope, axis] = [0, 0, 0, 0, 0];
  if (other.m) {
    const rocker = norm(minus(other.z, other.m)), ground = minus(other.m, m), long = norm(ground);
    [low, high] = [(bar - rocker) ** 2, (bar + rocker) ** 2];
    [value, slope, axis] = [crank * crank + long * long, -2 * crank * long, angleOf(ground)];
  } else {
    const normal = [-other.slide[1], other.slide[0]];
    [low, high] = [-bar, bar];
    [value, slope, axis] = [inner(minus(m, other.z), normal), crank, angleOf(normal)];
  }
  const arc = arcWhere(low, high, value, slope);
  return { ...arc, axis, middle: axis + arc.middle };
}

/** Sine of the transmission angle with its sign, at pins and the driven dyad's other end. */
function sineOf(A, B, other) {
  const bar = minus(B, A);
  if (!other.m) return inner(bar, other.slide) / norm(bar);
  const rocker = minus(other.m, B);
  return across(bar, rocker) / (norm(bar) * norm(rocker));
}

/** The driven dyad's pin where the crank's is at A, on the branch of a sign; null where it does not reach. */
export function closed(A, one, other, sign) {
  const bar = norm(minus(other.z, one.z));
  if (!other.m) {
    const way = other.slide, from = minus(A, other.z), off = across(way, from), rest = bar * bar - off * off;
    if (rest < 0) return null;
    const t = inner(from, way) + sign * Math.sqrt(rest);
    return [other.z[0] + t * way[0], other.z[1] + t * way[1]];
  }
  const rocker = norm(minus(other.z, other.m)), ground = minus(other.m, A), far = norm(ground);
  const x = (bar * bar - rocker * rocker + far * far) / (2 * far), rest = bar * bar - x * x;
  if (rest < 0) return null;
  const y = -sign * Math.sqrt(rest), [ex, ey] = [ground[0] / far, ground[1] / far];
  return [A[0] + x * ex - y * ey, A[1] + x * ey + y * ex];
}

/** Grashof's class of four lengths, the driven link first, ground last. */
export function classOf(crank, bar, rocker, ground) {
  const lengths = [crank, bar, rocker, ground], sorted = [...lengths].sort((a, b) => a - b);
  if (sorted[0] + sorted[3] >= sorted[1] + sorted[2]) return "triple-rocker";
  return ["crank-rocker", "double-rocker", "rocker-crank", "drag-link"][lengths.indexOf(sorted[0])];
}

/** A linkage driven by its first dyad. `branch`: all poses on one circuit and branch; `order`: met one after the other while the driver turns one way;
 * `angle`: the worst transmission angle on the way, of a crank over the turn. */
export function studied(one, other, displacements) {
  const pins = [one, other].map(({ z }) => [z, ...displacements.map((own) => moved(own, z))]);
  const ground = other.m ? norm(minus(other.m, one.m)) : 0;
  const [crank, bar, rocker] = [norm(minus(one.z, one.m)), norm(minus(other.z, one.z)), other.m ? norm(minus(other.z, other.m)) : 0];
  const arc = arcOf(one, other), sines = pins[0].map((A, k) => sineOf(A, pins[1][k], other)), sign = Math.sign(sines[0]);
  const turns = pins[0].map((A) => angleOf(minus(A, one.m)));
  let branch = sines.every((sine) => sine * sign > 0);
  const full = arc.half === Math.PI;
  if (arc.two) branch = branch && turns.every((turn) => Math.sin(turn - arc.axis) * Math.sin(turns[0] - arc.axis) > 0);
  const middle = arc.two && Math.sin(turns[0] - arc.axis) < 0 ? 2 * arc.axis - arc.middle : arc.middle;
  const along = full ? turns.map((turn) => turn - turns[0]) : turns.map((turn) => wrapped(turn - middle));
  const ordered = (sense) => {
    const ways = along.map((turn) => sense * (full ? turn : turn - along[0])).map((turn) => (full ? turn - FULL_TURN * Math.floor(turn / FULL_TURN + 1e-12) : turn));
    return ways.every((turn, k) => k === 0 || turn > ways[k - 1]);
  };
  const sense = ordered(1) ? 1 : -1, order = branch && (sense === 1 || ordered(-1));
  // the least sine is at a pose, or where the crank is in line with the ground, or upright to the guide
  const [begin, end] = [Math.min(...along), Math.max(...along)];
  const least = [arc.axis, arc.axis + Math.PI].filter((turn) => { const own = wrapped(turn - middle); return full || (own > begin && own < end); }).map((turn) => {
    const A = [one.m[0] + crank * Math.cos(turn), one.m[1] + crank * Math.sin(turn)], B = closed(A, one, other, sign);
    return B ? Math.abs(sineOf(A, B, other)) : 0;
  });
  return {
    class: other.m ? classOf(crank, bar, rocker, ground) : full ? "slider-crank" : "slider-rocker",
    full, branch, order, sense: order ? sense : 0, turns, sign, angle: Math.asin(Math.min(1, ...least, ...sines.map(Math.abs))),
    lengths: { crank, bar, rocker, ground },
  };
}
