/** The kinematic diagram of the plane: fragments that `draw/fragments.py` wrote, moved with points and bodies. */
import { pathOf, spotAt, View } from "./view.js";

/** How far a rack reaches beyond where its wheel comes, in radii. */
const BEYOND = 0.9, ZERO = [0, 0, 0];

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
    this.build();
    const pose = { places, angles, share, senses };
    this.drawing.parts.forEach((part, k) => {
      const made = this.elements[k], shown = part.shapes ? this.rigid(part, made, pose) : this.moving(part, made.firstChild, pose);
      made.setAttribute("display", shown ? "inline" : "none");
    });
  }

  rigid(part, made, pose) {
    const frame = this.frame(part, pose);
    if (!frame) return false;
    const spot = frame.place(part.spot ? spotAt(part.spot, pose.share) : ZERO, 0), [x, y] = part.spot ? (made.spot = this.inside(made, spot)) : spot;
    let more = part.spot || !part.turn ? "" : ` rotate(${((-frame.angle * 180) / Math.PI).toFixed(3)})`;
    const load = part.spot || !part.id.startsWith("load-") ? null : this.drawing.loads[part.id.slice(5)];
    if (load) {
      const [turn, size, across] = acting(load, pose.share, pose.senses[part.id.slice(5)]);
      if (!size) return false;
      const [u, v] = load.about || [0, 0];
      more += ` translate(${u} ${v}) rotate(${((-turn * 180) / Math.PI).toFixed(2)}) scale(${size} ${size * across}) translate(${-u} ${-v})`;
    }
    made.setAttribute("transform", `translate(${x.toFixed(2)} ${y.toFixed(2)})${more}`);
    return true;
  }

  moving(part, own, pose) {
    const corners = this.corners(part, pose);
    if (!corners) return false;
    if (part.radius) {
      const [[cx, cy]] = corners, [, x, y] = (part.corners || [ZERO])[0];
      for (const [name, value] of Object.entries({ cx, cy, r: part.radius * (x || y ? 1 : this.growth(part, pose)) })) own.setAttribute(name, value.toFixed(2));
    } else own.setAttribute("d", part.kind === "strokes" ? corners.map((_, k) => (k % 2 ? "" : pathOf(corners.slice(k, k + 2)))).join("") : pathOf(corners, part.kind === "area"));
    return true;
  }

  /** Corners of a fragment that is not rigid, in units; null where a place is not known. */
  corners(part, pose) {
    if (part.at[0].endsWith("/curve")) return this.curve(part, pose).map((place) => this.at(place));
    const frame = this.frame(part, pose), { corners = part.at.map((_, k) => [part.span ? k : 0, 0, 0]), period } = part;
    if (!frame || !period) return frame && corners.map(frame.place);
    const beyond = part.beyond || 0, count = Math.max(1, Math.round((frame.long + 2 * beyond) / period)); // hatching and teeth, again and again along a span
    return Array.from({ length: count }, (_, k) => corners.map(([own, x, y]) => { const share = (k + own) / count; return frame.place([share, x + beyond * (2 * share - 1), y]); })).flat();
  }

  /** Places [m] on the curve of a joint, which turns with its first body. */
  curve(part, pose) {
    const { first, curve } = this.joints.get(part.at[0].split("/")[0]), turn = this.angle(first.split(".")[0], pose), base = pose.places[first];
    if (!base || turn === undefined) return [];
    const [c, s] = [Math.cos(turn), Math.sin(turn)];
    return curve.map(([x, y]) => [base[0] + c * x - s * y, base[1] + s * x + c * y]);
  }

  /** Angle of what ways are told in, and where corners are (share of a span, x, y); null where a place is not known. */
  frame(part, pose) {
    const bases = part.paper ? [[part.paper[0] * this.size[0], (1 - part.paper[1]) * this.size[1]]] : part.at.map((name) => this.base(name, pose));
    const angle = this.angle(part.turn || "", pose), grow = this.growth(part, pose);
    if (!bases.every(Boolean) || angle === undefined || !Number.isFinite(grow)) return null;
    const [c, s] = [Math.cos(angle) * grow, Math.sin(angle) * grow];
    const middle = [0, 1].map((k) => bases.reduce((sum, base) => sum + base[k], 0) / bases.length);
    const place = ([share, x, y], k) => {
      const [a, b] = part.span ? bases : [part.spot || bases.length === 1 ? middle : bases[k], [0, 0]];
      return [a[0] + (part.span ? share * (b[0] - a[0]) : 0) + c * x + s * y, a[1] + (part.span ? share * (b[1] - a[1]) : 0) - s * x + c * y];
    };
    return { angle, place, long: part.span ? Math.hypot(bases[1][0] - bases[0][0], bases[1][1] - bases[0][1]) : 0 };
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

  /** A point in units, or the end of the way of a guide or rack. */
  base(name, pose) {
    const place = this.place(name, pose);
    return place && this.at(place);
  }

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

  /** How much longer ways are than they were written. */
  growth(part, pose) {
    if (!part.grow) return 1;
    return (this.measured(part.grow[0], pose) * this.scale) / part.grow[1];
  }

  /** A length [m] that ways are proportional to. */
  measured(grow, { places }) {
    if (grow === "m") return 1;
    if (grow.includes(">")) {
      const [a, b] = grow.split(">").map((name) => places[name]);
      return a && b ? Math.hypot(b[0] - a[0], b[1] - a[1]) : NaN;
    }
    const [name, key] = grow.split("/");
    return this.joints.get(name)[key];
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

/** Angle, size and sign across of a load's arrow against that drawn: of the nearest state of its sense, where that is known. */
function acting({ rows, back, sense }, share, known) {
  const at = share * (rows.length - 1), wanted = known && known * sense;
  const near = rows.map((row, k) => [Math.abs(k - at), row]).filter(([, [, size, way]]) => !wanted || (size && way === wanted)).sort(([a], [b]) => a - b);
  const [turn, size, way] = near.length ? near[0][1] : [0, 1, wanted];
  return way < 0 ? [turn + back[0], size, back[1]] : [turn, size, 1];
}
