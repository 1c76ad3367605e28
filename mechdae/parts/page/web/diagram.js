/** The kinematic diagram as SVG. */
import { Letters } from "./letters.js";

/** Names of joints that are longer give way to shorter ones at one place. */
const BRIEF = 3;
const SPACE = "http://www.w3.org/2000/svg";

/** @param {string} name @param {Record<string, any>} attributes @param {Element} [parent] */
export function element(name, attributes, parent) {
  const made = document.createElementNS(SPACE, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value));
  if (parent) parent.append(made);
  return made;
}

const cross = (o, a, b) => (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);

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

/** Draws poses of one scene; places are those of the points, in metres. */
export class Diagram {
  /** @param {SVGSVGElement} svg @param {any} scene */
  constructor(svg, scene) {
    this.svg = svg;
    this.scene = scene;
    this.box = null;
    /** Its place on the screen; null where that has to be looked up again. */
    this.rect = null;
    this.lettering = new Letters();
    /** What letters shun: lines, plates and discs of the pose drawn. */
    this.shunned = { strokes: [], plates: [], discs: [] };
    this.layers = Object.fromEntries(["traces", "limits", "ghosts", "ground", "wheels", "links", "arrows", "forces", "pins", "letters"].map(
      (name) => [name, element("g", { class: name === "limits" ? "limit" : name === "ghosts" ? "ghost" : name }, svg)]));
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

  measure() {
    this.rect = this.rect || this.svg.getBoundingClientRect();
    const { width, height } = this.rect;
    const [left, right, low, high] = this.box;
    const room = Math.max(34, 0.06 * Math.min(width, height));
    const across = Math.max(right - left, 1e-9), up = Math.max(high - low, 1e-9);
    this.scale = Math.min((width - 2 * room) / across, (height - 2 * room) / up);
    this.shift = [width / 2 - (this.scale * (left + right)) / 2, height / 2 + (this.scale * (low + high)) / 2];
    this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  }

  /** A place in the picture, in metres. */
  flat(place) { return place; }

  /** Metres to pixels. */
  at([x, y]) { return [this.shift[0] + this.scale * x, this.shift[1] - this.scale * y]; }

  /** Pixels to metres. */
  from([x, y]) { return [(x - this.shift[0]) / this.scale, (this.shift[1] - y) / this.scale]; }

  /** Corners of a body in pixels: none, the ends of a line, or a hull. */
  corners(body, places) {
    const corners = body.shape.map((name) => places[name]).filter(Boolean).map((place) => this.at(place));
    const distinct = corners.filter((c, k) => corners.findIndex((d) => Math.hypot(d[0] - c[0], d[1] - c[1]) < 0.5) === k);
    return distinct.length > 2 ? hull(distinct) : distinct;
  }

  path(corners) {
    return corners.length ? `M${corners.map((c) => c.map((v) => v.toFixed(2)).join(" ")).join("L")}${corners.length > 2 ? "Z" : ""}` : "";
  }

  outline(body, places) { return this.path(this.corners(body, places)); }

  /** Draw the pose; `driven` are the bodies whose motion is given. */
  draw(places, angles, driven) {
    const { ground, wheels, links, pins, letters } = this.layers;
    for (const layer of [ground, wheels, links, pins, letters]) layer.replaceChildren();
    this.shunned = { strokes: [], plates: [], discs: [] };
    for (const body of this.scene.bodies) {
      const corners = this.corners(body, places);
      if (corners.length) element("path", { d: this.path(corners), class: driven.includes(body.name) ? "body driven" : "body" }, links);
      this.shun(corners);
    }
    const taken = [];
    for (const joint of this.scene.joints) this.joint(joint, places, angles, taken);
    for (const body of this.scene.bodies) {
      for (const name of body.free) {
        if (!places[name]) continue;
        const [x, y] = this.at(places[name]);
        element("circle", { cx: x, cy: y, r: 2.6, class: "point" }, pins);
        this.letter(name.split(".")[1], [x, y], taken);
      }
      this.number(body, places);
    }
    this.write(taken);
  }

  /** Keep letters away from a line or a plate, and from its edges. */
  shun(corners) {
    const { strokes, plates } = this.shunned;
    corners.forEach((corner, k) => { if (k || corners.length > 2) strokes.push([corners[(k + corners.length - 1) % corners.length], corner]); });
    if (corners.length > 2) plates.push(corners);
  }

  joint(joint, places, angles, taken) {
    const { ground, wheels, links, pins } = this.layers;
    const first = places[joint.first], second = places[joint.second];
    if (!first || !second) return;
    const here = this.at(joint.axis === undefined && !joint.curve ? first : second);
    if (joint.axis !== undefined) {
      const body = joint.first.split(".")[0];
      const turned = (body === "ground" ? 0 : angles[body] ?? 0) + joint.axis;
      const along = [Math.cos(turned), -Math.sin(turned)];
      const [x0, y0] = this.at(first);
      const way = (here[0] - x0) * along[0] + (here[1] - y0) * along[1];
      const from = Math.min(0, way) - 26, to = Math.max(0, way) + 26;
      element("line", { x1: x0 + from * along[0], y1: y0 + from * along[1], x2: x0 + to * along[0], y2: y0 + to * along[1],
        class: body === "ground" ? "ground" : "guide" }, body === "ground" ? ground : links);
      this.shun([[x0 + from * along[0], y0 + from * along[1]], [x0 + to * along[0], y0 + to * along[1]]]);
      for (const side of [-6, 6]) {
        this.shun([-13, 13].map((own) => [here[0] + own * along[0] - side * along[1], here[1] + own * along[1] + side * along[0]]));
      }
      if (body === "ground") this.hatch([x0, y0], along, from, to);
      element("rect", { x: -13, y: -7, width: 26, height: 14, class: "block",
        transform: `translate(${here[0]} ${here[1]}) rotate(${(-turned * 180) / Math.PI})` }, pins);
      if (!joint.block) element("circle", { cx: here[0], cy: here[1], r: 3.8, class: "pin" }, pins);
    } else if (joint.curve) this.curve(joint, places, angles);
    else if (joint.ratio !== undefined || joint.radius !== undefined) {
      for (const [centre, radius] of this.circles(joint, first, second)) {
        const [x, y] = this.at(centre);
        element("circle", { cx: x, cy: y, r: radius * this.scale, class: "wheel" }, wheels);
      }
      return;
    } else if (joint.pin) {
      if (joint.fixed) this.support(here);
      if (joint.rigid) this.weld(joint, places, here);
      else element("circle", { cx: here[0], cy: here[1], r: 4, class: "pin" }, pins);
    } else {
      const ends = [[joint.first, this.at(first)], [joint.second, this.at(second)]];
      element("line", { x1: ends[0][1][0], y1: ends[0][1][1], x2: ends[1][1][0], y2: ends[1][1][1], class: "body" }, links);
      this.shun(ends.map(([, end]) => end));
      for (const [name, [x, y]] of ends) {
        if (name.startsWith("ground.")) this.support([x, y]);
        element("circle", { cx: x, cy: y, r: 4, class: "pin" }, pins);
      }
      this.letter(joint.name, [0, 1].map((axis) => (ends[0][1][axis] + ends[1][1][axis]) / 2), taken);
      return;
    }
    this.letter(joint.name, here, taken);
  }

  /** A corner that is filled: its bodies turn together. */
  weld(joint, places, [x, y]) {
    const arms = [joint.first, joint.second].flatMap((own) => {
      const body = this.scene.bodies.find(({ name }) => name === own.split(".")[0]);
      const others = (body ? body.shape : []).map((name) => places[name]).filter(Boolean).map((place) => this.at(place));
      const far = others.map(([u, v]) => [u - x, v - y]).sort((a, b) => Math.hypot(...b) - Math.hypot(...a))[0];
      const size = far ? Math.hypot(...far) : 0;
      return size > 1 ? [far.map((v) => (11 * v) / size)] : [];
    });
    const [a, b] = arms;
    if (b && Math.abs(a[0] * b[1] - a[1] * b[0]) > 12) element("path", { d: `M${x} ${y}l${a.join(" ")}L${x + b[0]} ${y + b[1]}Z`, class: "weld" }, this.layers.pins);
    else element("rect", { x: x - 4, y: y - 4, width: 8, height: 8, class: "weld" }, this.layers.pins);
  }

  /** Places on the curve of a joint, which turns with its first body. */
  onCurve(joint, places, angles) {
    const turn = angles[joint.first.split(".")[0]] ?? 0;
    const [x0, y0] = places[joint.first];
    const [c, s] = [Math.cos(turn), Math.sin(turn)];
    return joint.curve.map(([x, y]) => [x0 + c * x - s * y, y0 + s * x + c * y]);
  }

  curve(joint, places, angles) {
    const { wheels, pins } = this.layers;
    const corners = this.onCurve(joint, places, angles).map((place) => this.at(place));
    element("path", { d: `M${corners.map((c) => c.map((v) => v.toFixed(2)).join(" ")).join("L")}${joint.closed ? "Z" : ""}`,
      class: joint.closed && joint.roller ? "cam" : "track" }, wheels);
    for (let k = 8; k < corners.length; k += 8) this.shun([corners[k - 8], corners[k]]);
    const [x, y] = this.at(places[joint.second]);
    element("circle", { cx: x, cy: y, r: joint.roller ? joint.roller * this.scale : 3.2, class: joint.roller ? "roller" : "pin" }, pins);
  }

  /** Corners of what a joint's wheels and curves cover. */
  extent(joint, places, angles = {}) {
    if (joint.curve && places[joint.first]) return this.onCurve(joint, places, angles);
    const first = places[joint.first], second = places[joint.second];
    if (!first || !second || (joint.ratio === undefined && joint.radius === undefined)) return [];
    return this.circles(joint, first, second).flatMap(([[x, y], r]) => [[x - r, y - r], [x + r, y + r]]);
  }

  circles(joint, first, second) {
    if (joint.radius !== undefined) return [[first, joint.radius]];
    const apart = Math.hypot(second[0] - first[0], second[1] - first[1]);
    const size = Math.abs(joint.ratio);
    if (joint.strands) {
      const own = (0.3 * apart) / Math.max(1, size);
      return [[first, own], [second, own * size]];
    }
    const share = joint.ratio < 0 ? 1 + size : Math.abs(1 - joint.ratio);
    return share > 1e-9 && apart > 0 ? [[first, apart / share], [second, (apart / share) * size]] : [];
  }

  support([x, y]) {
    const { ground } = this.layers;
    element("path", { d: `M${x} ${y}l-8.5 13.5h17Z`, class: "ground" }, ground);
    this.hatch([x, y + 13.5], [1, 0], -13, 13);
    this.shunned.discs.push([x, y + 10, 11]);
  }

  hatch([x, y], along, from, to) {
    const side = [-along[1], along[0]];
    const down = side[1] >= 0 ? side : [-side[0], -side[1]];
    let path = `M${x + from * along[0]} ${y + from * along[1]}L${x + to * along[0]} ${y + to * along[1]}`;
    for (let t = from + 3; t < to; t += 5) {
      path += `M${x + t * along[0]} ${y + t * along[1]}l${5 * (down[0] - along[0])} ${5 * (down[1] - along[1])}`;
    }
    element("path", { d: path, class: "ground" }, this.layers.ground);
  }

  /** Names of joints at one place are merged: of several the short ones, if there are any. */
  letter(text, [x, y], taken) {
    const same = taken.find((other) => Math.hypot(other.x - x, other.y - y) < 3);
    const names = [...(same ? same.names : []), text], short = names.filter((own) => own.length <= BRIEF);
    const one = { x, y, names, text: (short.length ? short : names).join(", ") };
    if (same) Object.assign(same, one);
    else taken.push(one);
  }

  /** Write the letters of a pose, each where it covers nothing. */
  write(taken) {
    const { strokes, plates, discs } = this.shunned;
    const centres = this.lettering.centres(taken, strokes, plates, [...discs, ...taken.map(({ x, y }) => [x, y, 4])],
      [this.rect.width, this.rect.height]);
    taken.forEach(({ text }, k) => {
      const [x, y] = centres[k];
      element("text", { x: x.toFixed(1), y: y.toFixed(1), class: "letter" }, this.layers.letters).textContent = text;
    });
  }

  number(body, places) {
    const corners = body.shape.map((name) => places[name]).filter(Boolean).map((place) => this.at(place));
    if (corners.length < 2) return;
    const x = corners.reduce((sum, c) => sum + c[0], 0) / corners.length;
    const y = corners.reduce((sum, c) => sum + c[1], 0) / corners.length;
    this.disc([x, y], body.number);
  }

  /** The number of a body, beside those that are there. */
  disc(place, number) {
    const free = ([u, v]) => this.shunned.discs.every(([a, b, r]) => Math.hypot(a - u, b - v) > r + 8.5);
    const around = Array.from({ length: 16 }, (_, k) => [place[0] + (k < 8 ? 18 : 30) * Math.cos(k * Math.PI / 4), place[1] + (k < 8 ? 18 : 30) * Math.sin(k * Math.PI / 4)]);
    const [x, y] = [place, ...around].find(free) ?? place;
    element("circle", { cx: x, cy: y, r: 7.5, class: "disc" }, this.layers.letters);
    element("text", { x, y, class: "number" }, this.layers.letters).textContent = String(number);
    this.shunned.discs.push([x, y, 8.5]);
  }

  /** Faint poses: limit positions or other modes; `choose` is called with the index of one clicked. */
  faint(layer, poses, choose, names = []) {
    const group = this.layers[layer];
    group.replaceChildren();
    poses.forEach((places, k) => {
      const one = element("g", {}, group);
      for (const body of this.scene.bodies) {
        const path = this.outline(body, places);
        if (path) element("path", { d: path, class: "body" }, one);
      }
      if (names[k]) element("title", {}, one).textContent = names[k];
      if (choose) one.addEventListener("click", () => choose(k));
    });
  }

  traces(tracks) {
    const group = this.layers.traces;
    group.replaceChildren();
    for (const track of tracks) {
      let path = "";
      let pen = "M";
      for (const place of track) {
        if (!place) { pen = "M"; continue; }
        const [x, y] = this.at(place);
        path += `${pen}${x.toFixed(1)} ${y.toFixed(1)}`;
        pen = "L";
      }
      element("path", { d: path, class: "trace" }, group);
    }
  }

  /** Arrows at points, to the scale of the middle one; what is longer than the picture is cut, what is shorter than 2 pixels left out. */
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
}

/** One arrow from a place, `size` pixels along a direction of the picture. */
export function arrow(group, [x, y], [dx, dy], size, kind) {
  const head = Math.min(7, size / 2);
  element("path", { d: `M0 0H${(size - head).toFixed(2)}M${size.toFixed(2)} 0l${-head} -3v6Z`, class: kind,
    transform: `translate(${x.toFixed(2)} ${y.toFixed(2)}) rotate(${((Math.atan2(dy, dx) * 180) / Math.PI).toFixed(3)})` }, group);
}
