/** The diagram of a spatial mechanism: parallel projection that can be turned, near parts over far ones. */
import { element, hull, pathOf, View } from "./view.js";
import { across3, along3, outer, plus, ringOf, sizeOf, times, unit3 } from "./vectors.js";
import { pitchSurfaces } from "./wheels.js";

const RADIUS = 5.5, HALF = 9.5, SLEEVE = [12, 6.5], CROSS = 13, BALL = 4.6, SOCKET = 7.6, GAP = 3.5, PIECE = 9;

/** Right, up and towards the eye, for an azimuth and an elevation in degrees about an upward direction. */
export function basisOf({ azimuth, elevation, up }) {
  const k = up.reduce((best, v, i) => (Math.abs(v) > Math.abs(up[best]) ? i : best), 0);
  const start = [0, 1, 2].map((i) => (i === (k + 1) % 3 ? 1 : 0));
  const first = unit3(plus(start, up, -along3(start, up)));
  const second = outer(up, first);
  const a = (azimuth * Math.PI) / 180, e = (elevation * Math.PI) / 180;
  const eye = plus(times(plus(times(first, Math.cos(a)), second, Math.sin(a)), Math.cos(e)), up, Math.sin(e));
  const right = plus(times(first, -Math.sin(a)), second, Math.cos(a));
  return [right, outer(eye, right), eye];
}

export class SpaceDiagram extends View {
  constructor(svg, scene, drawing) {
    super(svg, scene, drawing, ["traces", "limits", "ghosts", "depths", "arrows", "forces", "parts", "triad", "scale"]);
    this.view = { ...scene.space };
    this.depths = this.layers.depths;
    this.turn(0, 0);
  }

  slid() { /* guides of space are drawn as far as they are */ }

  /** Outlines of bodies: the ends of a line, or a hull. */
  outlines(places) {
    return this.scene.bodies.map((body) => {
      const corners = [];
      for (const place of body.shape.map((name) => places[name]).filter(Boolean)) this.add(corners, [...this.at(place), 0]);
      return corners.length ? pathOf(corners.length > 2 ? hull(corners) : corners, corners.length > 2) : "";
    }).filter(Boolean);
  }

  /** Move the labels with their points, or with symbols that are moved along axes. */
  label(places, anchors) {
    this.build();
    const symbols = new Map([...anchors].map(([joint, { first }]) => [`${joint.name}/`, first]));
    this.drawing.parts.forEach(({ at, spot }, k) => {
      const bases = at.map((name) => symbols.get(name) || (places[name] && this.at(places[name]))), made = this.elements[k];
      const [x, y] = [0, 1].map((i) => bases.reduce((sum, base) => sum + (base ? base[i] : NaN), 0) / bases.length + spot[i + 1]);
      made.setAttribute("display", Number.isFinite(x) ? "inline" : "none");
      if (Number.isFinite(x)) made.setAttribute("transform", `translate(${x.toFixed(2)} ${y.toFixed(2)})`);
    });
  }

  /** Turn the view by degrees. */
  turn(azimuth, elevation) {
    this.view.azimuth = ((((this.view.azimuth + azimuth + 180) % 360) + 360) % 360) - 180;
    this.view.elevation = Math.max(-90, Math.min(90, this.view.elevation + elevation));
    this.basis = basisOf(this.view);
  }

  look(azimuth, elevation) {
    Object.assign(this.view, { azimuth, elevation });
    this.turn(0, 0);
  }

  /** The direction it began with. */
  home() { this.look(this.scene.space.azimuth, this.scene.space.elevation); }

  seen(place) { return this.basis.map((row) => along3(row, place)); }

  flat(place) { return place.length === 3 ? this.seen(place).slice(0, 2) : place; }

  at(place) { return super.at(this.flat(place)); }

  /** Pixels to the right and down, and towards the eye. */
  spot(place) {
    const [x, y, z] = this.seen(place);
    return [...super.at([x, y]), z * this.scale];
  }

  /** A direction on the screen: right, down, towards the eye. */
  way(direction) {
    const [x, y, z] = this.seen(direction);
    return [x, -y, z];
  }

  extent(places, turns = {}) {
    return this.scene.joints.flatMap((joint) => this.surfaces(joint, places, turns))
      .flatMap(({ corners, ends, radii, axis }) => corners || ends.flatMap((end, k) => ringOf(end, axis, radii[k], 12)));
  }

  /** Wheels and racks of a joint. */
  surfaces(joint, places, turns) {
    return joint.mesh ? pitchSurfaces(joint.mesh, places, (body, vector) => this.inSpace(body, vector, turns), this.spread(places), this.scene.space.reaches[joint.name]) : [];
  }

  fit(places) { super.fit([...places, ...this.scene.space.anchors].map((place) => this.flat(place))); }

  arrows(layer, kind, places, vectors) {
    super.arrows(layer, kind, places, Object.fromEntries(Object.entries(vectors).map(([name, vector]) => [name, this.flat(vector)])));
  }

  /** A vector of a body in the fixed frame; columns of its rotation one after the other. */
  inSpace(body, vector, turns) {
    if (body === "ground") return vector;
    const t = turns[body];
    return t ? [0, 1, 2].map((i) => t[i] * vector[0] + t[3 + i] * vector[1] + t[6 + i] * vector[2]) : null;
  }

  axisOf(joint, turns) {
    if (!joint.axis) return null;
    return this.inSpace(joint.first.split(".")[0], joint.axis, turns)
      || (joint.kind === "universal" ? null : this.inSpace(joint.second.split(".")[0], joint.axis2, turns));
  }

  draw(places, turns, share, driven) {
    this.depths.replaceChildren();
    this.parts = [];
    const moving = driven.map((name) => {
      const lead = this.scene.joints.find((joint) => joint.name === name);
      return lead ? lead[lead.second.startsWith("ground.") ? "first" : "second"].split(".")[0] : name;
    });
    const anchors = new Map();
    const ends = new Map(this.scene.bodies.map((body) => [body.name, []]));
    for (const joint of this.scene.joints) {
      if (!places[joint.first] || !places[joint.second]) continue;
      const axis = this.axisOf(joint, turns);
      const moved = axis && this.scene.space.moved[joint.name];
      const first = moved ? plus(places[joint.first], axis, moved) : places[joint.first];
      const second = moved || joint.pin ? first : places[joint.second];
      anchors.set(joint, { axis: axis && this.way(axis), first: this.spot(first), second: this.spot(second) });
      for (const [name, place] of [[joint.first, first], [joint.second, second]]) {
        const known = ends.get(name.split(".")[0]);
        if (known) this.add(known, this.spot(place));
      }
    }
    for (const body of this.scene.bodies) {
      for (const name of body.free) {
        if (!places[name]) continue;
        const here = this.spot(places[name]);
        this.add(ends.get(body.name), here);
        this.part(here[2] + 1, "circle", { cx: here[0], cy: here[1], r: 2.6, class: "point" });
      }
    }
    for (const [joint, { axis, first, second }] of anchors) this.symbol(joint, axis, first, second, ends, turns);
    for (const body of this.scene.bodies) this.link(body, ends.get(body.name), moving.includes(body.name));
    this.wheels(places, turns, anchors, moving);
    this.label(places, anchors);
    this.parts.sort((a, b) => a.depth - b.depth);
    this.depths.append(...this.parts.map((part) => part.made));
    this.triad();
    this.bar();
  }

  add(known, place) { if (!known.some((other) => sizeOf(plus(other, place, -1)) < 1)) known.push(place); }

  part(depth, name, attributes) { this.parts.push({ depth, made: element(name, attributes) }); }

  /** A line in pieces, each at its depth; away from its ends it leaves a gap in what is behind. */
  line(a, b, kind, gaps = true) {
    const length = Math.hypot(b[0] - a[0], b[1] - a[1]);
    const count = Math.max(1, Math.round(length / PIECE));
    for (let k = 0; k < count; k += 1) {
      const [p, q] = [k / count, (k + 1) / count].map((t) => plus(a, plus(b, a, -1), t));
      const d = `M${p[0].toFixed(2)} ${p[1].toFixed(2)}L${q[0].toFixed(2)} ${q[1].toFixed(2)}`;
      const depth = (p[2] + q[2]) / 2;
      if (gaps && k > 0 && k < count - 1) this.part(depth - GAP, "path", { d, class: "gap" });
      this.part(depth, "path", { d, class: kind });
    }
  }

  area(points, depth, kind) {
    this.part(depth, "path", { d: `M${points.map(([x, y]) => `${x.toFixed(2)} ${y.toFixed(2)}`).join("L")}Z`, class: kind });
  }

  link(body, places, driven) {
    const kind = driven ? "body driven" : "body";
    if (places.length === 2) this.line(places[0], places[1], kind);
    else if (places.length > 2) {
      const flat = hull(places.map((place) => [...place]));
      this.area(flat, Math.min(...places.map((place) => place[2])) - 1, "face");
      flat.forEach((place, k) => this.line(place, flat[(k + 1) % flat.length], kind));
      for (const place of places) {
        if (!flat.includes(place)) this.line(place, flat.reduce((best, own) => (sizeOf(plus(own, place, -1)) < sizeOf(plus(best, place, -1)) ? own : best)), kind);
      }
    }
  }

  barrel(center, axis, half, radius, kind) {
    const ends = [-1, 1].map((side) => ringOf(plus(center, axis, side * half), axis, radius));
    this.area(hull(ends.flat()), center[2], kind);
    this.area(ends[axis[2] >= 0 ? 1 : 0], center[2] + 0.01, `${kind} cap`);
  }

  stand(center, axis, reach) {
    let along = [axis[0], axis[1]];
    const size = Math.hypot(...along);
    along = size > 0.3 ? along.map((v) => (v / size) * Math.max(size, 0.6) * HALF) : [0.6 * HALF, 0];
    const length = Math.hypot(...along);
    let side = [-along[1] / length, along[0] / length];
    if (Math.abs(along[1]) > 0.85 * length ? side[0] < 0 : side[1] < 0) side = [-side[0], -side[1]];
    const foot = [center[0] + reach * side[0], center[1] + reach * side[1]];
    const ends = [-1.4, 1.4].map((k) => [foot[0] + k * along[0], foot[1] + k * along[1]]);
    const depth = center[2] - RADIUS - 2;
    this.area([[center[0] - 0.7 * along[0], center[1] - 0.7 * along[1]], [center[0] + 0.7 * along[0], center[1] + 0.7 * along[1]], ends[1], ends[0]], depth, "block");
    this.wall(ends[0], ends[1], side, depth);
  }

  wall(a, b, side, depth) {
    const length = Math.hypot(b[0] - a[0], b[1] - a[1]);
    const along = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
    let path = `M${a[0]} ${a[1]}L${b[0]} ${b[1]}`;
    for (let t = 3; t < length; t += 5) path += `M${a[0] + t * along[0]} ${a[1] + t * along[1]}l${5 * (side[0] - along[0])} ${5 * (side[1] - along[1])}`;
    this.part(depth, "path", { d: path, class: "ground" });
  }

  symbol(joint, axis, first, second, ends, turns) {
    const bodies = [joint.first, joint.second].map((name) => name.split(".")[0]);
    const fixed = bodies.indexOf("ground");
    const others = (k, here) => (ends.get(bodies[k]) || []).filter((place) => sizeOf(plus(place, here, -1)) > 1);
    if (joint.pointer) this.vector(first, second, fixed === 0 ? first : fixed === 1 ? second : null);
    else if (joint.kind === "revolute" && axis) {
      this.barrel(first, axis, HALF, RADIUS, "block");
      for (const side of [-1, 1]) this.line(plus(first, axis, side * HALF), plus(first, axis, side * (HALF + 5)), "shaft", false);
      if (fixed >= 0) this.stand(first, axis, 13);
    } else if (joint.sliding && axis) {
      const held = bodies[0] === "ground" && joint.kind !== "prismatic";
      const [sleeve, rod] = held ? [first, second] : [second, first];
      const now = along3(plus(sleeve, rod, -1), axis);
      const [low, high] = [Math.min(0, now) - (held && now > 0 ? 0 : 26), Math.max(0, now) + (held && now < 0 ? 0 : 26)];
      this.line(plus(rod, axis, low), plus(rod, axis, high), fixed === 0 && !held ? "rail" : "body");
      if (joint.kind === "prismatic") this.block(sleeve, axis);
      else this.barrel(sleeve, axis, SLEEVE[0], SLEEVE[1], "block");
      if (held || fixed === 1) this.stand(sleeve, axis, 14);
      else if (fixed === 0) {
        const out = Math.hypot(axis[0], axis[1]) > 0.15 ? unit3([axis[0], axis[1], 0]) : [0, 1, 0];
        for (const [k, sign] of [[low, -1], [high, 1]]) {
          const end = plus(rod, axis, k);
          this.wall([end[0] - 8 * out[1], end[1] + 8 * out[0]], [end[0] + 8 * out[1], end[1] - 8 * out[0]], [sign * out[0], sign * out[1]], end[2]);
        }
      }
    } else if (joint.kind === "universal" && axis) {
      const pin = this.inSpace(bodies[1], joint.axis2, turns);
      const own = [axis, pin && this.way(pin)];
      own.forEach((direction, k) => {
        if (!direction) return;
        this.line(plus(first, direction, -CROSS), plus(first, direction, CROSS), "shaft", false);
        const mean = others(k, first).reduce((sum, place) => plus(sum, unit3(plus(place, first, -1))), [0, 0, 0]);
        const way = unit3(plus(mean, direction, -along3(mean, direction)));
        const arc = Array.from({ length: 13 }, (_, j) => {
          const t = (Math.PI * j) / 12;
          return plus(plus(first, direction, CROSS * Math.cos(t)), way, CROSS * Math.sin(t));
        });
        for (let j = 0; j < 12; j += 1) this.line(arc[j], arc[j + 1], "fork", false);
      });
    } else if (joint.kind === "spherical") {
      this.part(first[2] + 0.5, "circle", { cx: first[0], cy: first[1], r: BALL, class: "block" });
      const back = others(0, first).reduce((sum, place) => plus(sum, unit3(plus(place, first, -1))), [0, 0, 0]);
      const angle = Math.atan2(back[1], back[0] || 1e-9);
      const [a, b] = [angle - 1.75, angle + 1.75].map((t) => [first[0] + SOCKET * Math.cos(t), first[1] + SOCKET * Math.sin(t)]);
      this.part(first[2], "path", { d: `M${a[0]} ${a[1]}A${SOCKET} ${SOCKET} 0 1 1 ${b[0]} ${b[1]}`, class: "shaft" });
    } else if (joint.kind === "planar" && axis) {
      const [u, v] = across3(axis);
      for (const [half, lift] of [[17, -1.5], [11, 1.5]]) {
        this.area([[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([i, j]) => plus(plus(plus(second, axis, lift), u, half * i), v, half * j)), second[2] + lift * Math.sign(axis[2]), "block");
      }
    } else {
      if (!joint.pin) this.line(first, second, "guide");
      this.part(first[2] + 0.5, "circle", { cx: first[0], cy: first[1], r: 3.5, class: "pin" });
      if (fixed >= 0) this.stand(first, [1, 0, 0], 13);
    }
  }

  /** Gears and racks as wire: what carries them is seen through them. */
  wheels(places, turns, anchors, moving) {
    const seen = new Set();
    for (const joint of this.scene.joints) {
      for (const { body, corners, ends, radii, axis, bearing } of this.surfaces(joint, places, turns)) {
        const kind = moving.includes(body) ? "wheel driven" : "wheel";
        if (corners) this.rack(corners.map((place) => this.spot(place)));
        else {
          const spots = ends.map((place) => this.spot(place));
          const key = `${body} ${spots.map((own) => own.map((v) => v.toFixed(0)))}`;
          if (seen.has(key)) continue;
          seen.add(key);
          this.wheel(spots, radii.map((r) => r * this.scale), this.way(axis), kind);
          this.spoke(body, ends, radii, axis, turns, kind);
          const found = [...anchors].find(([own]) => own.name === bearing);
          if (found) this.line(found[1].first, spots[radii[0] >= radii[1] ? 0 : 1], "body", false);
        }
      }
    }
  }

  wheel(ends, radii, axis, kind) {
    const rims = ends.map((end, k) => ringOf(end, axis, radii[k], 48));
    const outline = hull(rims.flat());
    const near = ends[0][2] >= ends[1][2] ? 0 : 1;
    const path = (points) => `M${points.map(([x, y]) => `${x.toFixed(2)} ${y.toFixed(2)}`).join("L")}Z`;
    this.part(ends[near][2], "path", { d: path(outline), class: kind });
    this.part(ends[near][2], "path", { d: path(rims[near]), class: `${kind} rim` });
    if (radii[0] !== radii[1]) this.part(ends[near][2], "path", { d: path(rims[1 - near]), class: `${kind} rim` });
  }

  /** A thin radius with a dot turns with the wheel. */
  spoke(body, ends, radii, axis, turns, kind) {
    const t = turns[body];
    if (body !== "ground" && !t) return;
    const own = t ? [0, 1, 2].map((i) => t[3 * i] * axis[0] + t[3 * i + 1] * axis[1] + t[3 * i + 2] * axis[2]) : axis;
    const mark = this.inSpace(body, across3(own)[0], turns);
    const wide = radii[0] >= radii[1] ? 0 : 1;
    const [a, b] = [ends[wide], plus(ends[wide], mark, radii[wide])].map((place) => this.spot(place));
    this.part(b[2], "path", { d: `M${a[0].toFixed(2)} ${a[1].toFixed(2)}L${b[0].toFixed(2)} ${b[1].toFixed(2)}`, class: `${kind} rim` });
    this.part(b[2] + 0.5, "circle", { cx: b[0], cy: b[1], r: 2.2, class: "point" });
  }

  rack(corners) {
    const along = plus(corners[1], corners[0], -1), across = plus(corners[3], corners[0], -1);
    const count = Math.max(2, Math.floor(sizeOf(along) / 5));
    let path = `M${corners.map(([x, y]) => `${x.toFixed(2)} ${y.toFixed(2)}`).join("L")}Z`;
    for (let k = 0; k < count; k += 1) {
      const [x, y] = plus(corners[0], along, (k + 0.5) / count);
      path += `M${x.toFixed(2)} ${y.toFixed(2)}l${across[0].toFixed(2)} ${across[1].toFixed(2)}`;
    }
    this.part(corners[0][2], "path", { d: path, class: "wheel rim" });
  }

  /** Largest extent of the points. */
  spread(places) {
    const all = Object.values(places).filter((place) => place && place.length === 3);
    return Math.max(...[0, 1, 2].map((k) => Math.max(...all.map((p) => p[k])) - Math.min(...all.map((p) => p[k]))), 0) || 1;
  }

  block(center, axis) {
    const [u, v] = across3(axis);
    const frame = [u, v, axis], halves = [SLEEVE[1], SLEEVE[1], SLEEVE[0]];
    frame.forEach((direction, k) => {
      const [i, j] = [0, 1, 2].filter((other) => other !== k);
      const middle = plus(center, direction, (direction[2] >= 0 ? 1 : -1) * halves[k]);
      const face = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([a, b]) => plus(plus(middle, frame[i], a * halves[i]), frame[j], b * halves[j]));
      this.area(face, center[2] + 0.01 * k, k === 2 ? "block cap" : "block");
    });
  }

  vector(tail, head, fixed) {
    this.line(tail, head, "body", true);
    const along = unit3([head[0] - tail[0], head[1] - tail[1], 0]);
    const back = plus(head, along, -11), side = [-along[1], along[0], 0];
    this.area([plus(head, along, -2), plus(back, side, 4), plus(back, side, -4)], head[2] + 1, "head");
    for (const place of [tail, head]) this.part(place[2] + 0.5, "circle", { cx: place[0], cy: place[1], r: 2.8, class: "pin" });
    if (fixed) this.wall([fixed[0] - 8, fixed[1] + 5], [fixed[0] + 8, fixed[1] + 5], [0, 1], fixed[2] - 3);
  }

  triad() {
    this.layers.triad.replaceChildren();
    const group = element("g", { transform: `translate(42 ${(this.size[1] - 42).toFixed(1)})` }, this.layers.triad);
    ["x", "y", "z"].forEach((name, k) => {
      const [x, y] = this.way([0, 1, 2].map((i) => (i === k ? 1 : 0)));
      element("path", { d: `M0 0L${(24 * x).toFixed(2)} ${(24 * y).toFixed(2)}`, class: "axis" }, group);
      element("text", { x: (32 * x).toFixed(2), y: (32 * y).toFixed(2), class: "number" }, group).textContent = name;
    });
  }
}
