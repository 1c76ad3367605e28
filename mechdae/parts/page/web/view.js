/** A picture of poses in metres on a sheet of units, which grow with the picture as those of `mechdae plot`. */
import { displayed } from "./units.js";
import { subtracted } from "./vectors.js";

const SPACE = "http://www.w3.org/2000/svg";
/** Axes in which a unit is a point, least and greatest scale, margin and strip below: as in `draw/style.py`. */
const AREA = [488, 306], SCALES = [0.75, 6], MARGIN = 34, STRIP = 22;

/** Room between a letter and its index, strokes of a hatched line, and half the longest label [units]. */
const AFTER = 0.5, MOST_STROKES = 5000, WIDEST = 80, ZERO = [0, 0, 0], ACTING = /^(driver|load|label-load)-/;

/** @param {string} name @param {Record<string, any>} attributes @param {Element} [parent] */
export function element(name, attributes, parent) {
  const made = document.createElementNS(SPACE, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value));
  if (parent) parent.append(made);
  return made;
}

const cross = (o, a, b) => (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);

/** How far a place is from the line between two others. */
export function fromLine([x, y], [ax, ay], [bx, by]) {
  const [dx, dy] = [bx - ax, by - ay], t = Math.min(1, Math.max(0, ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1)));
  return Math.hypot(ax + t * dx - x, ay + t * dy - y);
}

/** The corners of the convex hull, counter-clockwise. */
export function hull(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = (list) => {
    const chain = [];
    for (const point of list) {
      while (chain.length > 1 && cross(chain[chain.length - 2], chain[chain.length - 1], point) <= 1e-9) chain.pop();
      chain.push(point);
    }
    return chain.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

/** The path through places; undefined ones cut it. */
export function pathOf(places, closed = false) {
  let path = "", pen = "M";
  for (const place of places) {
    if (place) path += `${pen}${place[0].toFixed(2)} ${place[1].toFixed(2)}`;
    pen = place ? "L" : "M";
  }
  return closed && path ? `${path}Z` : path;
}

const colour = (own) => (own === "none" ? own : `var(--${own})`);

/** A path or circle with a paint: stroke, fill, width, dashes. */
export function painted(name, look, places) {
  const [stroke, fill, width, dash] = look.split(" ");
  return element(name, { stroke: colour(stroke), fill: colour(fill), "stroke-width": width, "stroke-linejoin": "round", "stroke-linecap": dash ? "butt" : "round", "stroke-dasharray": dash || "none", ...places });
}

/** A shape of a fragment: name, paint, where it is. */
function shapeOf([name, look, ...more]) {
  if (name === "text") {
    const [x, y, size, text, slanted, sign] = more;
    const made = element("text", { x, y, "font-size": size, "font-style": slanted ? "italic" : "normal", class: { false: "load", middle: "middle" }[sign] || "sign", style: `fill: ${colour(look)}` });
    made.textContent = text;
    return made;
  }
  const places = name === "circle" ? { cx: more[0], cy: more[1], r: more[2] } : { d: more[0] };
  return painted(name, look, Object.fromEntries(Object.entries(places).filter(([, value]) => value !== undefined)));
}

/** Where a label is in its frame: [share, x, y] between the rows of a way's shares that it glides between. */
function spotAt(rows, share) {
  const k = rows.findIndex(([at]) => at > share);
  if (k < 1) return rows[k ? rows.length - 1 : 0];
  const [a, b] = [rows[k - 1], rows[k]], t = (share - a[0]) / (b[0] - a[0]);
  return [0, 1, 2].map((i) => (i ? a[i] + t * (b[i] - a[i]) : 0));
}

/** The matrix of a reflection that turns a direction round. */
const mirror = ([x, y]) => [1 - 2 * x * x, -2 * x * y, -2 * x * y, 1 - 2 * y * y].map((part) => part.toFixed(5)).join(" ");

/** Draws poses of one scene; places are those of the points, in metres. */
export class View {
  /** @param {SVGSVGElement} svg @param {any} scene @param {any} drawing its fragments @param {string[]} layers names of groups, those below first */
  constructor(svg, scene, drawing, layers) {
    this.svg = svg;
    this.scene = scene;
    this.drawing = drawing;
    this.box = null;
    /** How much larger than to fit, and how far moved [units]. */
    this.zoomed = [1, 0, 0];
    /** Its place on the screen; null where that has to be looked up again. */
    this.rect = null;
    this.layers = Object.fromEntries(layers.map((name) => [name, element("g", { class: { limits: "limit", ghosts: "ghost" }[name] || name }, svg)]));
  }

  /** Make the elements of the fragments; false where they are there. */
  build() {
    if (this.built === this.drawing) return false;
    this.built = this.drawing;
    this.elements = this.drawing.parts.map((part) => {
      const made = element("g", { "data-id": part.id });
      for (const own of part.shapes || [[part.kind === "circle" ? "circle" : "path", part.look]]) made.append(shapeOf(own));
      return made;
    });
    this.layers.parts.replaceChildren(...this.elements);
    for (const { children: [letter, index] } of this.elements) { // as far behind it as this browser's font is wide
      if (index && letter.tagName === "text" && index.tagName === "text") index.setAttribute("x", Number(letter.getAttribute("x")) + letter.getComputedTextLength() + AFTER);
    }
    return true;
  }

  /** Move the fragments to a pose: `share` is how far it is along the way, for labels and loads; `senses` are those of resistances that are known. */
  update(pose) {
    this.build();
    this.drawing.parts.forEach((part, k) => {
      const made = this.elements[k], shown = !this.idle(part, pose) && (part.shapes ? this.rigid(part, made, pose) : this.moving(part, made.firstChild, pose));
      made.setAttribute("display", shown ? "inline" : "none");
    });
  }

  /** Whether a load or driver has nothing to act on: nothing but the ground is there. */
  idle({ id }, { places }) { return ACTING.test(id) && Object.keys(places).every((name) => name.startsWith("ground.")); }

  rigid(part, made, pose) {
    const frame = this.frame(part, pose);
    if (!frame) return false;
    const spot = frame.place(part.spot ? spotAt(part.spot, pose.share) : ZERO, 0), [x, y] = part.spot ? (made.spot = this.inside(made, spot)) : spot;
    let more = part.spot || !part.turn ? "" : ` rotate(${((-frame.angle * 180) / Math.PI).toFixed(3)})`;
    const load = part.spot ? null : this.acting(part.id, pose);
    if (load) {
      const { row: [turn, size], way, about: [u, v], across } = load;
      if (!size) return false;
      more += across && way < 0 ? ` matrix(${mirror(across)} 0 0)` : across ? "" : ` translate(${u} ${v}) rotate(${((-turn * 180) / Math.PI).toFixed(2)}) scale(${size * way}) translate(${-u} ${-v})`;
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
    const frame = this.frame(part, pose), { corners = part.at.map((_, k) => [part.span ? k : 0, 0, 0]), period } = part;
    if (!frame || !period) return frame && corners.map(frame.place);
    const beyond = part.beyond || 0, count = Math.min(Math.max(1, Math.round((frame.long + 2 * beyond) / period)), MOST_STROKES); // hatching and teeth, again and again along a span
    return Array.from({ length: count }, (_, k) => corners.map(([own, x, y]) => { const share = (k + own) / count; return frame.place([share, x + beyond * (2 * share - 1), y]); })).flat();
  }

  /** Angle of what ways are told in, and where corners are (share of a span, x, y); null where a place is not known. */
  frame(part, pose) {
    const known = part.paper ? [] : part.at.map((name) => this.place(name, pose)), angle = this.angle(part.turn || "", pose), grow = this.growth(part, pose);
    if (!known.every(Boolean) || angle === undefined || !Number.isFinite(grow)) return null;
    const bases = part.paper ? [this.corner(part.paper)] : known.map((place) => this.at(place));
    const [c, s] = [Math.cos(angle) * grow, Math.sin(angle) * grow];
    const middle = [0, 1].map((k) => bases.reduce((sum, base) => sum + base[k], 0) / bases.length);
    const place = ([share, x, y], k) => {
      const [a, b] = part.span ? bases : [part.spot || bases.length === 1 ? middle : bases[k], [0, 0]];
      return [a[0] + (part.span ? share * (b[0] - a[0]) : 0) + c * x + s * y, a[1] + (part.span ? share * (b[1] - a[1]) : 0) - s * x + c * y];
    };
    return { angle, place, long: part.span ? Math.hypot(bases[1][0] - bases[0][0], bases[1][1] - bases[0][1]) : 0 };
  }

  /** A corner of the sheet: right of it, above. */
  corner([right, top]) { return [right * this.size[0], (1 - top) * this.size[1]]; }

  /** How much longer ways are than they were written. */
  growth(part, pose) { return part.grow ? (this.measured(part.grow[0], pose) * this.scale) / part.grow[1] : 1; }

  /** A length [m] that ways are proportional to. */
  measured(grow, pose) {
    if (grow === "m") return 1;
    const [a, b] = grow.split(">").map((name) => this.place(name, pose));
    return a && b ? Math.hypot(...subtracted(b, a)) : NaN;
  }

  /** How a load acts against what was drawn of it: of the nearest state of its sense, where that is known; null of what is no load that changes. */
  acting(id, { share, senses }) {
    const name = id.startsWith("load-") ? id.slice(5) : "", load = name && this.drawing.loads[name];
    if (!load) return null;
    const { rows, sense } = load, at = share * (rows.length - 1), wanted = senses[name] && senses[name] * sense;
    const near = rows.map((row, k) => [Math.abs(k - at), row]).filter(([, row]) => !wanted || (row.at(-2) && row.at(-1) === wanted)).sort(([a], [b]) => a - b);
    const row = near.length ? near[0][1] : [0, 1, wanted];
    return { about: [0, 0], ...load, row, way: row.at(-1) };
  }

  /** Fit the view to places in metres. */
  fit(places) {
    let [left, right, low, high] = [Infinity, -Infinity, Infinity, -Infinity];
    for (const [x, y] of places) {
      if (!Number.isFinite(x + y)) continue;
      left = Math.min(left, x); right = Math.max(right, x);
      low = Math.min(low, y); high = Math.max(high, y);
    }
    if (left === Infinity) [left, right, low, high] = [-1, 1, -1, 1];
    this.box = [left, right, low, high];
    this.measure();
  }

  /** Units of the sheet: pixels of the screen over `k`. */
  measure() {
    this.rect = this.rect || this.svg.getBoundingClientRect();
    const { width, height } = this.rect;
    this.k = Math.min(Math.max(Math.min(width / AREA[0], height / AREA[1]), SCALES[0]), SCALES[1]);
    this.size = [width / this.k, height / this.k];
    const [left, right, low, high] = this.box;
    const room = this.size.map((side, k) => Math.max(side - 2 * MARGIN - k * STRIP, 40));
    const spans = Math.max((right - left) / room[0], (high - low) / room[1]);
    this.scale = spans > 0 ? 1 / spans : 1;
    const [times, x, y] = this.zoomed;
    this.scale *= times;
    this.shift = [this.size[0] / 2 - (this.scale * (left + right)) / 2 + x, (this.size[1] - STRIP) / 2 + (this.scale * (low + high)) / 2 + y];
    this.svg.setAttribute("viewBox", `0 0 ${this.size.map((side) => side.toFixed(3)).join(" ")}`);
    this.bar();
  }

  /** Show all `times` larger with a place of the sheet held; 0 fits all. */
  zoom(times, [x, y] = [0, 0]) {
    const [now, dx, dy] = this.zoomed, next = Math.min(Math.max(now * times, 0.2), 60), share = next / now;
    const [u, v] = [x - this.size[0] / 2 - dx, y - (this.size[1] - STRIP) / 2 - dy];
    this.zoomed = times ? [next, dx + (1 - share) * u, dy + (1 - share) * v] : [1, 0, 0];
    this.measure();
  }

  pan(x, y) {
    this.zoomed = [this.zoomed[0], this.zoomed[1] + x, this.zoomed[2] + y];
    this.measure();
  }

  /** A place in the picture, in metres. */
  flat(place) { return place; }

  /** Metres to units. */
  at([x, y]) { return [this.shift[0] + this.scale * x, this.shift[1] - this.scale * y]; }

  /** Where a label that is moved to a place of the sheet has to go so that all of it is seen. */
  inside(label, [x, y]) {
    if (x < 0 || x > this.size[0] || Math.min(x, this.size[0] - x) > WIDEST) return [x, y];
    const { x: from, width } = (label.ink ||= label.getBBox());
    return [Math.max(Math.min(x, this.size[0] - from - width - 1), 1 - from), y];
  }

  /** Units to metres. */
  from([x, y]) { return [(x - this.shift[0]) / this.scale, (this.shift[1] - y) / this.scale]; }

  /** Where an event is on the sheet. */
  under(event) {
    const { left, top } = this.svg.getBoundingClientRect();
    return [(event.clientX - left) / this.k, (event.clientY - top) / this.k];
  }

  /** Faint poses: limit positions or other modes; `choose` is called with the index of one clicked. */
  faint(layer, poses, choose, names = []) {
    const group = this.layers[layer];
    group.replaceChildren();
    poses.forEach((places, k) => {
      const one = element("g", {}, group);
      for (const d of this.outlines(places)) element("path", { d, class: "body" }, one);
      if (names[k]) element("title", {}, one).textContent = names[k];
      if (choose) one.addEventListener("click", () => choose(k));
    });
  }

  traces(tracks) {
    this.layers.traces.replaceChildren(...tracks.map((track) => element("path", { d: pathOf(track.map((place) => place && this.at(place))), class: "trace" })));
  }

  /** Arrows at points, to the scale of the middle one; what is longer than the picture is cut, what is shorter than 2 units left out. */
  arrows(layer, kind, places, vectors) {
    const group = this.layers[layer];
    group.replaceChildren();
    const sizes = Object.values(vectors).map(([x, y]) => Math.hypot(x, y)).filter((v) => v > 0).sort((a, b) => a - b);
    if (!sizes.length) return;
    const scale = 45 / sizes[Math.floor(sizes.length / 2)];
    for (const [name, vector] of Object.entries(vectors)) {
      const size = Math.min(Math.hypot(...vector) * scale, 160);
      if (size > 2 && places[name]) arrow(group, this.at(places[name]), [vector[0], -vector[1]], size, kind);
    }
  }

  /** A bar of a round length. */
  bar() {
    const [factor, name] = displayed("m"), about = ((0.2 * this.size[0]) / this.scale) * factor;
    const power = 10 ** Math.floor(Math.log10(about)), length = power * [5, 2, 1].find((k) => k * power <= about * (1 + 1e-9));
    const [x, y, way] = [this.size[0] - 6, this.size[1] - 10, (length / factor) * this.scale];
    this.layers.scale.replaceChildren(element("path", { d: `M${x} ${y - 3}v6v-3h${-way}v-3v6` }));
    element("text", { x: x - way - 5, y: y + 3, "text-anchor": "end" }, this.layers.scale).textContent = `${Number(length.toPrecision(1))} ${name}`;
  }
}

/** One arrow from a place, `size` units along a direction of the picture. */
export function arrow(group, [x, y], [dx, dy], size, kind) {
  const head = Math.min(7, size / 2);
  element("path", { d: `M0 0H${(size - head).toFixed(2)}M${size.toFixed(2)} 0l${-head} -3v6Z`, class: kind,
    transform: `translate(${x.toFixed(2)} ${y.toFixed(2)}) rotate(${((Math.atan2(dy, dx) * 180) / Math.PI).toFixed(3)})` }, group);
}
