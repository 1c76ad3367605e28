/** A rough sketch as a pose: bodies are put one after the other, then all equations are closed together. */
import { eliminated } from "../path.js";
import { bodyOf } from "./mechanism.js";
import { Place, Rows } from "./rows.js";

const CLOSE = 1e-9, SHUT = 1e-14, MOST_ROUNDS = 200, ATTEMPTS = 40, PINS = ["revolute", "weld"];

/** Closes the rows near q by Levenberg-Marquardt, whatever their number: {q, worst, row}. */
export function joined(rows, q, u = []) {
  const at = (place) => {
    const own = new Place(place), values = rows.map((row, i) => (own.value(row) - (u[i] ?? 0)) * (row.weight ?? 1));
    return { own, values, worst: Math.max(0, ...values.map(Math.abs)), sum: values.reduce((sum, value) => sum + value * value, 0) };
  };
  let now = at(q), pose = q, damping = 1e-3;
  for (let round = 0; round < MOST_ROUNDS && now.worst > SHUT; round += 1) {
    const normal = q.map(() => new Float64Array(q.length)), right = new Array(q.length).fill(0);
    rows.forEach((row, i) => {
      const line = now.own.gradient(row, new Float64Array(q.length)), some = [...line.keys()].filter((j) => line[j]);
      const weight = row.weight ?? 1;
      for (const j of some) { right[j] += weight * line[j] * now.values[i]; for (const k of some) normal[j][k] += weight * weight * line[j] * line[k]; }
    });
    normal.forEach((line, j) => { line[j] += damping; });
    const step = eliminated(normal, right);
    if (!step || !step.every(Number.isFinite)) break;
    const tried = pose.map((value, j) => value - step[j]), next = at(tried);
    if (next.sum < now.sum) { [now, pose] = [next, tried]; damping = Math.max(damping / 10, 1e-15); } else if ((damping *= 10) > 1e6) break;
  }
  return { q: pose, worst: now.worst, row: now.values.reduce((best, value, i) => (Math.abs(value) > Math.abs(now.values[best]) ? i : best), 0), shut: now.worst <= CLOSE };
}

/** The drawing of a mechanism: rows, the pose, whether it closes and where not. @param {any} mechanism @param {number[] | null} near a pose to begin with */
export function drawnPose(mechanism, near = null) {
  const rows = new Rows(mechanism, mechanism.size), { drivers, sketch } = mechanism;
  const led = drivers.map(({ name }) => rows.coordinate(name));
  const known = led.every(Boolean) ? drivers : [];
  const wanted = known.map(({ owner, begin }, k) => (near ? new Place(near).value(led[k]) : (sketch.has(owner) ? sketch.get(owner) : begin) / led[k].unit));
  const all = [...rows.joints, ...(known.length ? led : [])], shift = [...rows.joints.map(() => 0), ...wanted];
  const angles = new Map(sketch);
  known.forEach(({ owner }, k) => { if (led[k].unit === 1) angles.set(owner, wanted[k]); });
  let best = null;
  for (let k = 0, guess = [], before; k < ATTEMPTS && !(best && best.shut && !best.moved); k += 1) {
    [before, guess] = [guess, rows.followed(near || walked(mechanism, rows, angles, k))];
    if (k && guess.every((value, j) => Object.is(value, before[j]))) break; // nothing is unknown that attempts differ by
    let found = joined(all, guess, shift);
    if (!found.shut && known.length) { const free = joined(rows.joints, found.q); if (free.shut) found = { ...free, moved: true }; }
    if (!best || found.worst < best.worst) best = found;
  }
  return { rows, led: known.length ? led : null, ...best, open: best.shut ? "" : (all[best.row] || {}).name ?? "" };
}

/** Places and angles of the bodies, one after the other from points that are known, in units of the size. */
function walked(mechanism, rows, sketch, attempt) {
  const { bodies, joints } = mechanism, q = new Array(rows.n).fill(null), known = new Map();
  for (const [name, place] of mechanism.ground) known.set(`ground.${name}`, place);
  const angleOf = new Map(bodies.filter(({ name }) => sketch.has(name)).map(({ name }) => [name, sketch.get(name)]));
  for (const { kind, first, second, name, drawn } of joints) {
    if (kind === "revolute" && drawn && bodyOf(first) === "ground" && sketch.has(name) && !angleOf.has(bodyOf(second))) angleOf.set(bodyOf(second), sketch.get(name));
  }
  const spread = () => {
    for (let more = true; more;) {
      more = false;
      for (const { kind, drawn, first, second, axis, turn, name } of joints) {
        if (!drawn) continue;
        const [a, b] = [first, second].map((own) => known.get(own)), [one, two] = [first, second].map(bodyOf);
        if (PINS.includes(kind) && Boolean(a) !== Boolean(b)) { known.set(a ? second : first, a || b); more = true; }
        const base = one === "ground" ? 0 : q[3 * rows.body(one) + 2];
        if (base === null) continue;
        if (["prismatic", "weld"].includes(kind) && !angleOf.has(two)) { angleOf.set(two, base + turn); more = true; }
        if (["prismatic", "pin-in-slot"].includes(kind) && a && !b && sketch.has(name)) {
          known.set(second, [a[0] + sketch.get(name) * Math.cos(base + axis), a[1] + sketch.get(name) * Math.sin(base + axis)]);
          more = true;
        }
      }
    }
  };
  const put = (k, angle) => {
    const { name, points } = bodies[k], [c, s] = [Math.cos(angle), Math.sin(angle)];
    const anchor = [...points.keys()].find((own) => known.has(`${name}.${own}`));
    const [x, y] = anchor ? known.get(`${name}.${anchor}`) : [0, 0], [u, v] = anchor ? points.get(anchor) : [0, 0];
    const origin = [x - c * u + s * v, y - s * u - c * v];
    q.splice(3 * k, 3, origin[0] / rows.size, origin[1] / rows.size, angle);
    for (const [own, [a, b]] of points) if (!known.has(`${name}.${own}`)) known.set(`${name}.${own}`, [origin[0] + c * a - s * b, origin[1] + s * a + c * b]);
    spread();
  };
  spread();
  for (let left = bodies.map((_, k) => k); left.length; left = left.filter((k) => q[3 * k] === null)) {
    const anchors = (k) => [...bodies[k].points.keys()].filter((own) => known.has(`${bodies[k].name}.${own}`));
    const angle = (k) => angleOf.get(bodies[k].name);
    const k = left.find((own) => angle(own) !== undefined && anchors(own).length) ?? left.find((own) => anchors(own).length > 1) ?? left.find((own) => anchors(own).length) ?? left[0];
    const [i, j] = anchors(k), { name, points } = bodies[k];
    if (angle(k) !== undefined || j === undefined) put(k, angle(k) ?? (points.size < 2 ? 0 : 2 * Math.PI * (((attempt + 1) * (k + 1) * 0.618033988749895) % 1)));
    else {
      const way = ([a, b], [c, d]) => Math.atan2(d - b, c - a);
      put(k, way(known.get(`${name}.${i}`), known.get(`${name}.${j}`)) - way(points.get(i), points.get(j)));
    }
  }
  return q;
}

/** Beyond a limit: the pose in which the drivers have their values and the joints stay open as little as can be, and the widest gap [m]. */
export function opened({ rows, led, q }, near, u) {
  const held = led.map((row) => ({ ...row, weight: 1e3 })), shift = [...rows.joints.map(() => 0), ...u.map((value, k) => value / led[k].unit)];
  const found = joined([...rows.joints, ...held], near || q, shift).q, place = new Place(found), gaps = new Map();
  for (const row of rows.joints) gaps.set(row.name, Math.hypot(gaps.get(row.name) || 0, place.value(row)));
  const [name, gap] = [...gaps].reduce((best, own) => (own[1] > best[1] ? own : best), ["", 0]);
  return { q: found, name, gap: gap * rows.size };
}

/** Mobility by count and by rank, and the joints whose equations find no pivot. */
export function mobility(rows, q) {
  const place = new Place(q), pivots = [], without = new Set();
  for (const row of rows.joints) {
    const rest = place.gradient(row, new Float64Array(q.length));
    for (const { at, own } of pivots) {
      const share = rest[at] / own[at];
      if (share) for (let j = 0; j < rest.length; j += 1) rest[j] -= share * own[j];
    }
    const at = rest.reduce((best, value, j) => (Math.abs(value) > Math.abs(rest[best]) ? j : best), 0);
    if (Math.abs(rest[at] || 0) > 1e-9) pivots.push({ at, own: rest }); else without.add(row.name);
  }
  return { count: q.length - rows.joints.length, rank: q.length - pivots.length, without: [...without] };
}

/** Bodies that no joint connects with the ground, not even through others. */
export function hanging({ bodies, joints }) {
  const reached = new Set(["ground"]);
  for (let more = true; more;) {
    more = false;
    for (const { drawn, first, second } of joints) {
      const [a, b] = [first, second].map(bodyOf);
      if (drawn && reached.has(a) !== reached.has(b)) { reached.add(a).add(b); more = true; }
    }
  }
  return bodies.map(({ name }) => name).filter((name) => !reached.has(name));
}

