/** The kinematic diagram of the plane: fragments that `draw/fragments.py` wrote, moved with points and bodies. */
import { pathOf, View } from "./view.js";

/** How far a rack reaches beyond where its wheel comes, in radii. */
const BEYOND = 0.9;

export class Diagram extends View {
  /** @param {SVGSVGElement} svg @param {any} scene @param {any} drawing its fragments */
  constructor(svg, scene, drawing) {
    super(svg, scene, drawing, ["traces", "limits", "ghosts", "parts", "arrows", "forces", "scale"]);
  }

  build() {
    if (super.build()) this.joints = new Map(this.scene.joints.map((joint) => [joint.name, joint]));
  }

  /** Draw a pose; `share` is how far it is along the way, for labels and loads; `senses` are those of resistances that are known. */
  draw(places, angles, share = 0, senses = {}) {
    this.update({ places, angles, share, senses });
  }

  corners(part, pose) {
    return part.at[0].endsWith("/curve") ? this.curve(part, pose).map((place) => this.at(place)) : super.corners(part, pose);
  }

  /** Places [m] on the curve of a joint, which turns with its first body. */
  curve(part, pose) {
    const { first, curve } = this.joints.get(part.at[0].split("/")[0]), turn = this.angle(first.split(".")[0], pose), base = pose.places[first];
    if (!base || turn === undefined) return [];
    const [c, s] = [Math.cos(turn), Math.sin(turn)];
    return curve.map(([x, y]) => [base[0] + c * x - s * y, base[1] + s * x + c * y]);
  }

  angle(turn, { places, angles }) {
    if (!turn) return 0;
    if (turn.includes(">")) {
      const [a, b] = turn.split(">").map((name) => places[name]);
      return a && b && Math.atan2(b[1] - a[1], b[0] - a[0]);
    }
    const [name, kind] = turn.split("/"), joint = kind && this.joints.get(name);
    const body = joint ? joint[kind === "rack" ? "second" : "first"].split(".")[0] : name;
    const own = body === "ground" ? 0 : angles[body];
    return own === undefined ? undefined : own + ((joint && joint.axis) || 0);
  }

  /** A point [m], or the end of the way of a guide or rack. */
  place(name, pose) {
    const [own, end] = name.split("/"), { places } = pose;
    if (!end) return places[own];
    const joint = this.joints.get(own), first = places[joint.first], second = places[joint.second];
    const rack = joint.radius !== undefined, angle = this.angle(`${own}/${rack ? "rack" : "axis"}`, pose);
    if (!first || !second || angle === undefined) return null;
    const [c, s] = [Math.cos(angle), Math.sin(angle)], high = end === "high";
    const reach = this.drawing.reach[own][high ? 1 : 0];
    if (!rack) return [first[0] + reach * c, first[1] + reach * s];
    const now = (first[0] - second[0]) * c + (first[1] - second[1]) * s;
    const [along, across] = [reach - now + (high ? BEYOND : -BEYOND) * joint.radius, joint.side * joint.radius];
    return [first[0] + along * c - across * s, first[1] + along * s + across * c];
  }

  /** A length [m] that ways are proportional to, that of a joint too. */
  measured(grow, pose) {
    const [name, key] = grow.split("/");
    return key ? this.joints.get(name)[key] : super.measured(grow, pose);
  }

  /** How far points slide along guides and racks over poses [places, angles]: where dimensions are not those of the file. */
  slid(poses) {
    this.build();
    for (const [name, reach] of Object.entries(this.drawing.reach)) {
      const { first, second, radius } = this.joints.get(name), rack = radius !== undefined;
      const ways = poses.map(([places, angles]) => {
        const [a, b] = [places[first], places[second]], angle = this.angle(`${name}/${rack ? "rack" : "axis"}`, { places, angles });
        return a && b && angle !== undefined ? (rack ? -1 : 1) * ((b[0] - a[0]) * Math.cos(angle) + (b[1] - a[1]) * Math.sin(angle)) : NaN;
      }).filter(Number.isFinite);
      if (ways.length) [reach[0], reach[1]] = [Math.min(...ways), Math.max(...ways)];
    }
  }

  /** Places [m] between which what is drawn of wheels, guides and curves lies in a pose. */
  extent(places, angles = {}) {
    this.build();
    const pose = { places, angles };
    return this.drawing.parts.flatMap((part) => {
      if (part.radius && part.grow) {
        const [x, y] = places[part.at[0]] || [NaN, NaN], r = (part.radius * this.measured(part.grow[0], pose)) / part.grow[1];
        return [[x - r, y - r], [x + r, y + r]];
      }
      const ends = part.shapes ? [] : part.at.filter((name) => name.includes("/"));
      if (!ends.length) return [];
      return ends[0].endsWith("/curve") ? this.curve(part, pose) : ends.map((name) => this.place(name, pose)).filter(Boolean);
    });
  }

  /** Outlines of links where only their points are known. */
  outlines(places) {
    const bodies = this.drawing.parts.filter(({ id, shapes, turn }) => !shapes && !turn && id.startsWith("body-"));
    return bodies.map((part) => this.corners(part, { places, angles: {} })).filter(Boolean).map((corners) => pathOf(corners, corners.length > 2));
  }
}
