/** What is drawn of a sketch, put together from the symbols of `draw/fragments.py`. */
import { bodyOf } from "./mechanism.js";
import { fromLine, hull } from "../view.js";

/** A cylinder's tube beside its whole length in the drawn pose, and half its width. */
const TUBE = 0.62, TUBE_HALF = 5;

const text = (own, size, slanted = size > 9) => ["text", "ink", 0, 0, size, own, slanted, "middle"];
/** Where a mass is, in the names of places. */
const centerOf = (body) => `${body}.(m)`;

/** Places [m] and angles of a sketch at unknowns q: those of points, and of centres of mass. */
export function placesOf(sketch, q) {
  const { mechanism, pose: { rows } } = sketch, places = {}, angles = {};
  for (const [name, place] of mechanism.ground) places[`ground.${name}`] = place;
  mechanism.bodies.forEach(({ name, points, mass, center }, k) => {
    const [x, y, angle] = [q[3 * k] * rows.size, q[3 * k + 1] * rows.size, q[3 * k + 2]], [c, s] = [Math.cos(angle), Math.sin(angle)];
    const at = ([u, v]) => [x + c * u - s * v, y + s * u + c * v];
    for (const [own, place] of points) places[`${name}.${own}`] = at(place);
    if (mass) places[centerOf(name)] = at(center);
    angles[name] = angle;
  });
  return { places, angles };
}

/** How far letters are from their points, and from what is drawn [units]; how far guides, supports and arrows of drivers reach. */
const LETTER = 16, ROOMY = 15, BLOCK = 13, GUIDE = 70, SUPPORT = [13, 16], ARC = 19;

/** Scene and fragments of a sketch. @param {any} sketch @param {any} symbols templates @param {number} scale units of the sheet per metre */
export function drawnBy(sketch, symbols, scale) {
  const { mechanism, pose } = sketch, { places, angles } = placesOf(sketch, pose.q);
  const parts = [], joints = [], reach = {}, loads = {}, letters = [];
  const line = (id, at, paint) => parts.push({ id, at, ...paint });
  const sign = (id, at, shapes, more = {}) => parts.push({ id, at: [at], shapes, ...more });
  const led = mechanism.drivers.map(({ name }) => name), driven = new Set(led.map(bodyOf));
  const cylinder = (name) => mechanism.pointsOf(name).size === 1;
  for (const { name, points } of mechanism.bodies) {
    const at = [...points.keys()].map((own) => `${name}.${own}`), look = symbols[driven.has(name) ? "driven" : "bar"];
    if (at.length < 2) continue;
    const around = hull(at.map((own) => [...places[own], own]));
    if (around.length > 2) {
      line(`body-${name}-polygon`, around.map(([, , own]) => own), symbols.face);
      around.forEach(([, , own], k) => line(`body-${name}-bar`, [own, around[(k + 1) % around.length][2]], look));
    } else line(`body-${name}-bar`, around.map(([, , own]) => own), look);
  }
  for (const joint of mechanism.joints) {
    const { name, kind, first, second, axis, drawn } = joint, turn = `${name}/axis`;
    if (joint.curve) cam(joint);
    if (!drawn) continue;
    if (kind === "distance") line(`joint-${name}-distance`, [first, second], symbols.distance);
    if (joint.ratio && places[first] && places[second]) wheels(joint).forEach((own) => parts.push(own));
    if (kind === "rack") racked(joint);
    if (kind !== "prismatic" && kind !== "pin-in-slot") continue;
    joints.push({ name, first, second, axis });
    reach[name] = [0, 0];
    const ground = bodyOf(first) === "ground";
    if (kind === "prismatic" && !ground && cylinder(bodyOf(first)) && cylinder(bodyOf(second))) {
      const tube = [[0, 0, TUBE_HALF], [TUBE, 0, TUBE_HALF], [TUBE, 0, -TUBE_HALF], [0, 0, -TUBE_HALF]];
      line(`joint-${name}-rod`, [first, second], symbols[led.includes(`${name}.slide`) ? "driven" : "bar"]);
      parts.push({ id: `joint-${name}-tube`, at: [first, second], turn: `${first}>${second}`, span: true, corners: tube, ...symbols.tube });
      continue;
    }
    const ends = { at: [`${name}/low`, `${name}/high`], span: true, turn };
    for (const part of symbols[ground ? "guide" : "slot"]) parts.push({ id: `joint-${name}-guide`, ...ends, ...part });
    if (kind === "prismatic") sign(`joint-${name}-block`, second, symbols.block, { turn });
  }
  for (const node of sketch.nodes) pinned(node);
  for (const name of led) driver(name);
  for (const { name, mass } of mechanism.bodies) if (mass) sign(`mass-${name}`, centerOf(name), symbols.mass);
  for (const load of mechanism.loads) if (load.drawn) acting(load);
  lettered();
  mechanism.bodies.forEach(({ name, number, points }, k) => {
    const at = [...points.keys()].map((own) => `${name}.${own}`), wide = parts.some(({ id }) => id === `body-${name}-polygon`);
    if (at.length > 1) parts.push({ id: `number-${name}`, at, turn: name, spot: [[0, 0, wide ? 0 : 12]], shapes: [symbols.disc, text(String(number ?? k + 1), 9)] });
  });
  return { scene: { joints }, drawing: { parts, reach, loads } };

  /** A curve with what follows it; what lies within a moving one is its cam. */
  function cam({ name, first, second, curve, loop, roller_radius: roller }) {
    const at = [`${name}/curve`], look = symbols[driven.has(bodyOf(first)) ? "driven" : "bar"];
    joints.push({ name, first, second, axis: 0, curve });
    const faces = loop && bodyOf(first) !== "ground" ? [{ id: `joint-${name}-cam`, at, ...symbols.face }] : [];
    parts.unshift(...faces, { id: `joint-${name}-curve`, at, ...look });
    if (roller) parts.push({ id: `joint-${name}-roller`, at: [second], grow: ["m", 1], ...symbols.roller, radius: roller });
  }

  /** A pitch circle on a rack, whose body is on the other side. */
  function racked({ name, first, second, axis, radius }) {
    const side = radius > 0 ? -1 : 1;
    joints.push({ name, first, second, axis, radius: Math.abs(radius), side });
    reach[name] = [0, 0];
    parts.push({ id: `joint-${name}-wheel`, at: [first], grow: ["m", 1], ...symbols.wheel, radius: Math.abs(radius) });
    for (const part of symbols.rack) parts.push({ id: `joint-${name}-rack`, at: [`${name}/low`, `${name}/high`], span: true, turn: `${name}/rack`, ...part, corners: part.corners.map(([share, x, y]) => [share, x, -side * y]) });
  }

  /** Pitch circles, and the radius that shows to which link a wheel belongs. */
  function wheels({ name, kind, first, second, ratio, radius, second_radius: other }) {
    const [a, b] = [places[first], places[second]], far = Math.hypot(b[0] - a[0], b[1] - a[1]);
    const whole = kind === "belt" ? far / (1 + Math.abs(ratio)) / 1.5 : far / Math.abs(ratio < 0 ? 1 - ratio : ratio === 1 ? 1 : ratio - 1);
    const radii = kind === "friction-wheel" ? [radius, other] : [radius || whole, Math.abs(ratio) * (radius || whole)];
    const far2 = Math.sign(ratio) * radii[1], sine = (radii[0] - far2) / far, cosine = Math.sqrt(1 - sine * sine); // tangents of both
    const strands = kind === "belt" && cosine > 0 ? [cosine, -cosine].map((side) => ({ id: `joint-${name}-strand`, at: [first, second], span: true, turn: `${first}>${second}`, grow: ["m", 1], corners: [[0, radii[0] * sine, radii[0] * side], [1, far2 * sine, far2 * side]], ...symbols.strand })) : [];
    return [...strands, ...[first, second].flatMap((own, k) => [
      { id: `joint-${name}-wheel`, at: [own], grow: ["m", 1], ...symbols[kind === "gear" ? "wheel" : "rim"], radius: radii[k] },
      { id: `body-${bodyOf(own)}-wheel`, at: [own], turn: bodyOf(own), grow: ["m", 1], corners: [[0, 0, 0], [0, radii[k], 0]], ...symbols.spoke },
    ])];
  }

  function pinned({ id, refs, name, fixed, guide }) {
    const own = refs.filter((reference) => !reference.startsWith("ground."));
    if (!own.length) {
      if (!mechanism.joints.some(({ first, kind, second }) => (first === id && kind !== "distance" && kind !== "revolute") || (kind === "rack" && second === id))) {
        letters.push([name, id]);
        sign(`support-${name}`, id, symbols.support);
        sign(`joint-${name}-pin`, id, symbols.pin);
      }
      return;
    }
    const here = own[0], welded = mechanism.joints.some(({ kind, first, second }) => kind === "weld" && refs.includes(first) && refs.includes(second));
    letters.push([name, here]);
    if (fixed) sign(`support-${name}`, here, symbols.support);
    if (welded) sign(`joint-${name}-weld`, here, symbols.weld);
    else sign(`joint-${name}-pin`, here, own.length > 1 || fixed || guide || mechanism.joints.some(({ first, second, kind }) => (first === here || second === here) && kind !== "gear") ? symbols.pin : symbols.dot);
  }

  function driver(name) {
    const [owner, key] = name.split("."), joint = mechanism.joints.find((own) => own.name === owner);
    if (key === "slide" && joint) { if (bodyOf(joint.first) === "ground") sign("driver", joint.second, symbols.travel, { turn: `${owner}/axis` }); return; }
    const body = joint ? bodyOf(joint.second) : owner, points = [...mechanism.pointsOf(body).keys()];
    const fixed = points.find((own) => (sketch.nodeOf.get(`${body}.${own}`) || {}).fixed) ?? points[0], far = points.find((own) => own !== fixed);
    if (fixed) sign("driver", `${body}.${fixed}`, symbols.arrow, { turn: far ? `${body}.${fixed}>${body}.${far}` : body });
  }

  function acting(load) {
    const { name, kind, points, own } = load;
    if (kind === "force") {
      const [x, y] = [0, 1].map((k) => sketch.amount(load, "value", k)), body = own.frame && own.frame !== "world" ? own.frame : "";
      loads[name] = { rows: [[Math.atan2(y, x), Math.hypot(x, y) > 0 ? 1 : 0, 1]] };
      sign(`load-${name}`, points[0], symbols.force, body ? { turn: body } : {});
    } else if (kind === "torque") sign(`load-${name}`, `${own.body}.${[...mechanism.pointsOf(own.body).keys()][0]}`, symbols.torque);
    else if (kind === "spring" && points.length) for (const part of symbols.spring) parts.push({ id: `load-${name}`, at: points, span: true, turn: `${points[0]}>${points[1]}`, ...part });
  }

  /** Letters where least is in their way: links, guides, springs, supports, arrows of drivers, points and other letters. */
  function lettered() {
    const at = (reference) => places[reference].map((v) => v * scale), lines = [], away = ([x, y], angle, r) => [x + r * Math.cos(angle), y + r * Math.sin(angle)];
    for (const { name, points } of mechanism.bodies) { const all = [...points.keys()].map((own) => at(`${name}.${own}`)); all.forEach((a, i) => all.slice(0, i).forEach((b) => lines.push([a, b]))); }
    for (const { kind, drawn, first, second, axis } of mechanism.joints) {
      if (!drawn || !["distance", "prismatic", "pin-in-slot"].includes(kind)) continue;
      const ground = bodyOf(first) === "ground", way = axis + (ground ? 0 : angles[bodyOf(first)]);
      for (const off of ground ? [7, 0, -9] : []) { const middle = away(at(second), way + Math.PI / 2, off), long = off > 0 ? BLOCK : GUIDE; lines.push([away(middle, way, -long), away(middle, way, long)]); }
      if (!ground) lines.push([at(first), at(second)]);
    }
    for (const { curve, second, roller_radius: roller } of mechanism.joints) if (curve && roller) { const rim = Array.from({ length: 13 }, (_, k) => away(at(second), (k * Math.PI) / 6, roller * scale)); rim.slice(1).forEach((end, k) => lines.push([rim[k], end])); }
    for (const { points } of mechanism.loads) if (points.length === 2) lines.push(points.map(at));
    for (const { id, fixed } of sketch.nodes) if (fixed) { const [x, y] = at(id), low = y - SUPPORT[1]; lines.push([[x, y], [x, low]], [[x - SUPPORT[0], low], [x + SUPPORT[0], low]]); }
    for (const { id, at: [own], turn } of parts) {
      if (id !== "driver" || turn.endsWith("/axis")) continue;
      const [a, b] = turn.includes(">") ? turn.split(">").map(at) : [], angle = b ? Math.atan2(b[1] - a[1], b[0] - a[0]) : angles[turn], arc = [0.4, 0.8, 1.2, 1.6].map((more) => away(at(own), angle + more, ARC));
      arc.slice(1).forEach((end, k) => lines.push([arc[k], end]));
    }
    for (const [own, here] of letters) {
      const from = at(here), rim = mechanism.joints.reduce((most, { second, roller_radius: roller }) => (second === here && roller ? roller * scale : most), 0), far = rim > LETTER / 3 && rim < 2 * LETTER ? rim + LETTER / 1.5 : LETTER, free = (place) => Math.min(ROOMY, ...lines.map(([a, b]) => fromLine(place, a, b)));
      const spots = Array.from({ length: 16 }, (_, k) => away(from, (Math.PI * (k + 4)) / 8, far)).map((place) => [place, free(place)]);
      const [place] = spots.reduce((best, spot) => (spot[1] > best[1] + 0.5 ? spot : best));
      sign(`label-${own}`, here, [text(own, 14)], { spot: [[0, place[0] - from[0], from[1] - place[1]]] });
      lines.push([place, place]);
    }
  }
}
