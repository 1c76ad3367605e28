/** Gears and racks in space: pitch cylinders, cones and planes, as `draw/space/spatial_wheels.py` has them. */
import { along3, outer, plus, sizeOf, times, unit3 } from "./vectors.js";

const EVEN = 1e-9, FACE = 0.2, CONE = 0.25, BEYOND = 0.9;

/** A wheel or rack on its carrier: axis, a point of it, its own point of the mesh. */
function memberOf({ body, carrier, axis, at, end, own, bearing }, places, inSpace) {
  const way = inSpace(carrier, axis);
  if (!way || !places[at] || !places[end] || !places[own]) return null;
  return { body, bearing, axis: way, place: places[at], end: places[end], own: places[own] };
}

const footOf = (member, place) => plus(member.place, member.axis, along3(member.axis, plus(place, member.place, -1)));

/** Wheels with `ends`, `radii`, `axis`, and racks with `corners`; none where there are no teeth. `reach`: how far a rack slides. */
export function pitchSurfaces(mesh, places, inSpace, size, reach) {
  const members = mesh.members.map((own) => memberOf(own, places, inSpace));
  if (!members[0] || !members[1]) return [];
  const pitch = mesh.point ? places[mesh.point] : null;
  if (mesh.rack) return withRack(mesh, members, pitch, reach);
  const [first, second] = members;
  const cross = outer(first.axis, second.axis), sine = sizeOf(cross);
  if (sine > EVEN && Math.abs(along3(cross, plus(second.place, first.place, -1))) <= EVEN * sine * size) return cones(mesh, members, pitch, size);
  const touch = pitch || rolling(first, second, mesh.ratio);
  if (!touch) return [];
  let feet = members.map((member) => footOf(member, touch));
  const radii = feet.map((foot) => sizeOf(plus(touch, foot, -1)));
  if (Math.min(...radii) <= EVEN * size) return [];
  if (sine <= EVEN) feet = members.map((member) => footOf(member, member.own));
  const half = 0.5 * FACE * Math.min(...radii);
  return members.map((member, k) => ({ ...member, radii: [radii[k], radii[k]], ends: [-half, half].map((t) => plus(feet[k], member.axis, t)) }));
}

/** The point of the relative screw axis on the common perpendicular. */
function rolling(first, second, ratio) {
  const turn = plus(times(first.axis, ratio), second.axis, -1), square = along3(turn, turn);
  if (square <= EVEN) return null;
  const gap = plus(second.place, first.place, -1);
  const point = plus(first.place, outer(turn, outer(second.axis, gap)), 1 / square);
  const normal = outer(first.axis, second.axis), sine = along3(normal, normal);
  if (Math.sqrt(sine) <= EVEN) return plus(footOf(first, first.own), plus(point, footOf(first, point), -1));
  const foot = plus(first.place, first.axis, along3(outer(gap, second.axis), normal) / sine);
  return plus(point, turn, along3(turn, plus(foot, point, -1)) / square);
}

function cones(mesh, members, pitch, size) {
  const [first, second] = members;
  const gap = plus(second.place, first.place, -1), cosine = along3(first.axis, second.axis);
  const apex = plus(first.place, first.axis, (along3(gap, first.axis) - cosine * along3(gap, second.axis)) / (1 - cosine ** 2));
  const way = unit3(plus(times(first.axis, mesh.ratio), second.axis, -1));
  const sines = members.map((member) => sizeOf(outer(member.axis, way)));
  if (Math.min(...sines) <= EVEN) return [];
  let length = 0;
  if (pitch) length = along3(plus(pitch, apex, -1), way);
  else {
    for (const member of members) {
      const height = along3(plus(member.own, apex, -1), member.axis), slope = along3(way, member.axis);
      if (Math.abs(slope) > EVEN && Math.abs(height / slope) > Math.abs(length)) length = height / slope;
    }
    if (mesh.radius > 0) length = (mesh.radius / sines[0]) * (length < 0 ? -1 : 1);
  }
  length = length || CONE * size;
  const along = [1 - FACE, 1 + FACE].map((share) => share * length);
  return members.map((member, k) => ({
    ...member,
    ends: along.map((t) => plus(apex, member.axis, along3(way, member.axis) * t)),
    radii: along.map((t) => Math.abs(t) * sines[k]),
  }));
}

function withRack(mesh, [wheel, rack], pitch, reach) {
  const foot = footOf(wheel, pitch || wheel.own);
  const away = outer(rack.axis, wheel.axis);
  if (!pitch && sizeOf(away) <= EVEN) return [];
  const touch = pitch || plus(foot, unit3(away), mesh.radius);
  const out = plus(touch, foot, -1), radius = sizeOf(out), half = 0.5 * FACE * radius;
  if (radius <= 0) return [];
  const side = outer(unit3(out), rack.axis);
  const here = along3(plus(rack.end, rack.place, -1), rack.axis), [least, most] = reach || [here, here];
  const ways = [Math.min(here - most, 0) - BEYOND * radius, Math.max(here - least, 0) + BEYOND * radius];
  const corners = [[0, -1], [1, -1], [1, 1], [0, 1]].map(([k, sign]) => plus(plus(touch, rack.axis, ways[k]), side, 1.4 * half * sign));
  return [
    { ...wheel, radii: [radius, radius], ends: [-half, half].map((t) => plus(foot, wheel.axis, t)) },
    { body: rack.body, corners },
  ];
}
