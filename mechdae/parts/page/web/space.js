/** The diagram of a spatial mechanism: facets that `draw/fragments.py` wrote, moved with bodies, projected, painted from far to near. */
import { element, hull, painted, pathOf, View } from "./view.js";
import { across3, along3, moment, outer, plus, times, unit3 } from "./vectors.js";

/** Lines are cut into pieces, each at its depth; gaps where lines cross so far behind others, so wide; what faces hide is dashed. */
const PIECE = 9, BEHIND = 5, GAP = 3.2, HIDDEN = "1.2 3,2.5", CORNERS = 28, ORIGIN = [0, 0, 0];

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

/** Places on a circle told by its middle, a place on its axis, a place on it. */
function circleOf([middle, pole, rim]) {
  const first = plus(rim, middle, -1), second = outer(unit3(plus(pole, middle, -1)), first);
  return Array.from({ length: CORNERS }, (_, k) => plus(plus(middle, first, Math.cos((2 * Math.PI * k) / CORNERS)), second, Math.sin((2 * Math.PI * k) / CORNERS)));
}

/** A way as a mirror across a direction shows it. */
const mirrored = (way, across) => plus(way, across, -2 * along3(way, across));

/** Corners on the sheet of a facet, as `Facet.flat` has them; null where it is not seen. */
function flatOf(kind, size, places) {
  const [shape, round] = kind.split(" ");
  if (shape === "face" || shape === "hatch") {
    const ways = [1, 2].map((k) => plus(places[k], places[0], -1));
    if ((round ? ways[0][2] : moment(...ways)) <= 0) return null;
  }
  const all = round ? Array.from({ length: places.length / 3 }, (_, k) => circleOf(places.slice(3 * k, 3 * k + 3))).flat() : places;
  if (shape === "hull") return hull(all);
  if (shape !== "head") return all;
  const [behind, tip] = all, way = Math.hypot(tip[0] - behind[0], tip[1] - behind[1]);
  const along = way > 0 ? [(tip[0] - behind[0]) / way, (tip[1] - behind[1]) / way, 0] : [1, 0, 0];
  const back = plus(tip, along, -size), side = [-0.4 * size * along[1], 0.4 * size * along[0], 0];
  return [tip, plus(back, side), plus(back, side, -1)];
}

/** Whether a place is inside of a polygon. */
function insideOf([x, y], corners) {
  let inside = false;
  corners.forEach(([ax, ay], k) => {
    const [bx, by] = corners[(k + 1) % corners.length];
    if (ay > y !== by > y && x < ax + ((y - ay) / (by - ay)) * (bx - ax)) inside = !inside;
  });
  return inside;
}

/** Depth of the plane through corners at a place. */
function depthAt(corners, [x, y]) {
  const n = outer(plus(corners[1], corners[0], -1), plus(corners[2], corners[0], -1)), [a, b, c] = corners[0];
  return Math.abs(n[2]) < 1e-9 ? c : c - (n[0] * (x - a) + n[1] * (y - b)) / n[2];
}

export class SpaceDiagram extends View {
  constructor(svg, scene, drawing) {
    super(svg, scene, drawing, ["traces", "limits", "ghosts", "depths", "arrows", "forces", "parts", "triad", "scale"]);
    this.view = { ...scene.space };
    this.depths = this.layers.depths;
    this.turn(0, 0);
  }

  slid() { /* guides of space are drawn as far as they are */ }

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

  fit(places) { super.fit(places.map((place) => this.flat(place))); }

  arrows(layer, kind, places, vectors) {
    super.arrows(layer, kind, places, Object.fromEntries(Object.entries(vectors).map(([name, vector]) => [name, this.flat(vector)])));
  }

  /** Directions that something turns with, as columns in the fixed frame: of a body, of a line between two places. */
  turned(turn, { places, turns }) {
    if (turn.includes(">")) {
      const [a, b] = turn.split(">").map((name) => this.place(name, { places, turns })), way = a && b && unit3(plus(b, a, -1));
      return way && [...across3(way), way];
    }
    const t = turns[turn];
    if (!turn || turn === "ground") return [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    return t && [0, 1, 2].map((k) => t.slice(3 * k, 3 * k + 3));
  }

  /** A point, or a place along an axis, in the fixed frame. */
  place(name, pose) {
    const row = this.drawing.along[name];
    if (!row) return pose.places[name];
    const [point, body, axis, way] = row, columns = this.turned(body, pose), place = pose.places[point];
    return place && columns && columns.reduce((sum, column, k) => plus(sum, column, way * axis[k]), place);
  }

  /** Angle in the picture of a line between two places, or of the axis that a place is along. */
  angle(turn, pose) {
    if (!turn) return 0;
    const [point, body, axis] = this.drawing.along[turn] || [], columns = point && this.turned(body, pose);
    const [a, b] = point ? [ORIGIN, columns && columns.reduce((sum, column, k) => plus(sum, column, axis[k]), ORIGIN)] : turn.split(">").map((name) => this.place(name, pose));
    return a && b ? Math.atan2(...this.flat(plus(b, a, -1)).reverse()) : undefined;
  }

  /** What becomes of the ways of a load's arrow as it acts now; null where it does not. */
  loaded(id, pose) {
    const load = this.acting(id, pose);
    if (!load) return (way) => way;
    const { row, way: sign, about, across, from, axis } = load, size = row.at(-2);
    if (!size) return null;
    if (axis) { // turned by two mirrors
      const half = plus(axis, row), between = Math.hypot(...half) > 0.05 ? unit3(half) : across;
      return (way) => mirrored(mirrored(way, axis), between);
    }
    if (across) return sign < 0 ? (way) => mirrored(way, across) : (way) => way;
    return from ? (way) => times(row.slice(0, 3), size * along3(way, from)) : (way) => plus(about, plus(way, about, -1), size * sign);
  }

  /** Shapes of a part with their places in units: right, up, towards the eye; none where something is not known. */
  shapes(part, pose) {
    const bases = part.at.map((name) => this.place(name, pose)), columns = part.turn === "eye" ? this.basis : this.turned(part.turn, pose), loaded = this.loaded(part.id, pose);
    if (!bases.every(Boolean) || !columns || !loaded || this.idle(part, pose)) return [];
    const ways = columns.map((column) => this.seen(column)), spots = part.paper ? [this.under3(part.paper)] : bases.map((base) => times(this.seen(base), this.scale));
    const grow = this.growth(part, pose);
    return part.shapes.map(([kind, look, size, row]) => {
      const count = row.length / 3, each = spots.length === count;
      const places = Array.from({ length: count }, (_, k) => loaded(row.slice(3 * k, 3 * k + 3)).reduce((sum, way, i) => plus(sum, ways[i], grow * way), spots[each ? k : 0]));
      return { kind, look, size, places };
    });
  }

  /** Outlines of bodies. */
  outlines(places) {
    const lines = this.drawing.solids.filter(({ id }) => id.startsWith("body-") || id.startsWith("vector-"));
    return lines.map((part) => part.at.map((name) => this.place(name, { places, turns: {} }))).filter((ends) => ends.length > 1 && ends.every(Boolean))
      .map((ends) => pathOf(ends.map((end) => this.at(end)), ends.length > 2));
  }

  /** Places [m] that symbols along axes and wheels reach to. */
  extent(places, turns = {}) {
    const pose = { places, turns };
    this.scale = this.scale || 1;
    const round = this.drawing.solids.filter((part) => part.grow).flatMap((part) => this.shapes(part, pose)).filter(({ kind }) => kind === "hull round");
    const rims = round.flatMap(({ places: own }) => Array.from({ length: own.length / 3 }, (_, k) => circleOf(own.slice(3 * k, 3 * k + 3))).flat());
    const back = rims.map((own) => this.basis.reduce((sum, row, k) => plus(sum, row, own[k] / this.scale), [0, 0, 0]));
    return [...back, ...Object.keys(this.drawing.along).map((name) => this.place(name, pose)).filter(Boolean)];
  }

  draw(places, turns, share = 0, senses = {}) {
    const pose = { places, turns, share, senses };
    const made = this.drawing.solids.flatMap((part) => this.shapes(part, pose).map((shape) => ({ ...shape, id: part.id, owner: part.owner })));
    const faces = made.filter(({ kind, owner }) => owner !== undefined && kind === "area");
    const lines = made.filter(({ kind, owner }) => owner !== undefined && kind === "line");
    this.painted = [];
    for (const face of faces) this.paint(Math.min(...face.places.map((place) => place[2])) - 1e6, face.look, face.id, { d: pathOf(face.places.map((place) => this.down(place)), true) });
    for (const line of lines) {
      this.pieces(line, (place) => faces.some((face) => face.owner !== line.owner && insideOf(place, face.places) && depthAt(face.places, place) > place[2] + BEHIND));
      this.gaps(line, lines, faces);
    }
    for (const { kind, look, size, places: own, owner, id } of made) {
      if (owner !== undefined) continue;
      if (kind === "line") { this.pieces({ look, id, places: own }, () => false); continue; }
      const flat = flatOf(kind, size, own);
      if (!flat) continue;
      const middles = kind.endsWith("round") ? own.filter((_, k) => k % 3 === 0) : own, [x, y] = this.down(flat[0]);
      const depth = middles.reduce((sum, place) => sum + place[2], 0) / middles.length + (kind === "dot" ? 2 * BEHIND : 0);
      if (kind === "dot") this.paint(depth, look, id, { cx: x.toFixed(2), cy: y.toFixed(2), r: size });
      else if (kind === "strokes" || kind === "hatch") this.paint(depth, look, id, { d: flat.map((place, k) => (k % 2 ? "" : pathOf([place, flat[k + 1]].map((end) => this.down(end))))).join("") });
      else this.paint(depth, look, id, { d: pathOf(flat.map((place) => this.down(place)), true) });
    }
    this.painted.sort((a, b) => a.depth - b.depth);
    this.depths.replaceChildren(...this.painted.map((part) => part.made));
    this.update(pose);
    this.triad();
  }

  /** A place told from a corner of the sheet, as others are. */
  under3([right, top, dx, dy]) {
    const [x, y] = this.corner([right, top]);
    return [x + dx - this.shift[0], this.shift[1] - y + dy, 0];
  }

  /** Units of the sheet, y down. */
  down([x, y]) { return [this.shift[0] + x, this.shift[1] - y]; }

  paint(depth, look, id, where) { this.painted.push({ depth, made: painted(where.d === undefined ? "circle" : "path", look, { "data-id": id, ...where }) }); }

  pieces({ look, id, places }, hides) {
    places.slice(1).forEach((b, i) => {
      const a = places[i], count = Math.max(1, Math.round(Math.hypot(b[0] - a[0], b[1] - a[1]) / PIECE)), way = plus(b, a, -1);
      for (let k = 0; k < count; k += 1) {
        const ends = [k / count, (k + 1) / count].map((t) => plus(a, way, t)), middle = plus(a, way, (k + 0.5) / count);
        this.paint(middle[2], hides(middle) ? `${look.split(" ").slice(0, 2).join(" ")} ${HIDDEN}` : look, id, { d: pathOf(ends.map((end) => this.down(end))) });
      }
    });
  }

  /** Gaps in lines that pass well behind a line, away from the ends of both. */
  gaps(line, lines, faces) {
    for (const behind of lines) {
      const [[p, q], [r, s]] = [line, behind].map(({ places }) => places), u = plus(q, p, -1), v = plus(s, r, -1), cross = moment(u, v);
      if (Math.abs(cross) < 1e-9) continue;
      const w = plus(r, p, -1), t = moment(w, v) / cross, k = moment(w, u) / cross, at = plus(p, u, t), size = Math.hypot(u[0], u[1]);
      if (t < 0 || t > 1 || k < 0 || k > 1 || at[2] - (r[2] + k * v[2]) < BEHIND) continue;
      if (faces.some((face) => insideOf(at, face.places)) || [p, q, r, s].some((end) => Math.hypot(end[0] - at[0], end[1] - at[1]) < 2 * GAP)) continue;
      const half = 0.5 * Number(behind.look.split(" ")[2]) + 2;
      const ends = [-half, half].map((way) => this.down(plus(at, u, way / size)));
      this.paint(at[2] - 0.5 * BEHIND, `paper none ${Number(line.look.split(" ")[2]) + 2 * GAP}`, "", { d: pathOf(ends) });
    }
  }

  triad() {
    this.layers.triad.replaceChildren();
    const group = element("g", { transform: `translate(42 ${(this.size[1] - 42).toFixed(1)})` }, this.layers.triad);
    ["x", "y", "z"].forEach((name, k) => {
      const [x, y] = this.basis.map((row) => row[k]);
      element("path", { d: `M0 0L${(24 * x).toFixed(2)} ${(-24 * y).toFixed(2)}`, class: "axis" }, group);
      element("text", { x: (32 * x).toFixed(2), y: (-32 * y).toFixed(2), class: "number" }, group).textContent = name;
    });
  }
}
