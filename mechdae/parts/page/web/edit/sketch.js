/** A drawing: the text of a problem file, the mechanism it describes, the pose of its sketch; each gesture is one entry of undo. */
import { drawnPose, mobility } from "./closing.js";
import { drive } from "./driven.js";
import { Place } from "./rows.js";
import { bodyOf, Mechanism, ownerOf, pointOf } from "./mechanism.js";
import { numeral } from "./numbers.js";
import { Refused } from "../read_toml.js";
import { TomlText } from "./toml_text.js";

export const DEGREE = Math.PI / 180;
const LINKED = ["revolute", "weld"], LOCKED = "locked";
export const quoted = (value) => JSON.stringify(value);
export const inDegrees = (angle) => numeral(Math.round((100 * angle) / DEGREE) / 100);
/** An empty file. */
export const blank = (title) => `schema = 1\ntitle = ${quoted(title)}\n`;

export class Sketch {
  /** @param {string} text @param {any} units */
  constructor(text, units) {
    Object.assign(this, { units, before: [], after: [], seen: 0.1 });
    this.load(text);
    this.kept = this.text;
  }

  load(text, near = null) {
    const toml = new TomlText(text), mechanism = new Mechanism(toml, this.units);
    const guess = near && mechanism.bodies.map(({ name }) => near.get(name));
    let pose = drawnPose(mechanism, guess && guess.every(Boolean) ? guess.flatMap(([x, y, angle]) => [x / mechanism.size, y / mechanism.size, angle]) : null);
    if (guess && !pose.shut) { const again = drawnPose(mechanism); if (again.shut) pose = again; }
    Object.assign(this, { toml, mechanism, pose, numbers: mechanism.numbers, text: toml.text });
    this.nodes = mechanism.nodes.map((node) => ({ ...node, ...this.facts(node) }));
    this.nodeOf = new Map(this.nodes.flatMap((node) => node.refs.map((reference) => [reference, node])));
  }

  facts({ id, refs }) {
    const [x, y] = this.place(id), block = this.mechanism.joints.find(({ kind, drawn, second }) => drawn && kind === "prismatic" && refs.includes(second) && this.isBlock(bodyOf(second)));
    return { x, y, name: pointOf(id), guide: block || null };
  }

  /** A body of one point, which a guide holds. */
  isBlock(body) { return this.mechanism.pointsOf(body).size === 1 && this.mechanism.joints.some(({ kind, second }) => kind === "prismatic" && bodyOf(second) === body); }

  get links() { return this.mechanism.bodies.filter(({ points }) => points.size > 1); }

  /** How many links have no length. */
  get flat() { return this.links.filter(({ name }) => !(this.lengths(name)[0].value > 0)).length; }

  /** Origin and angle of a body, in SI. */
  frame(body) {
    const k = this.pose.rows.body(body), { q } = this.pose, { size } = this.pose.rows;
    return k < 0 ? [0, 0, 0] : [q[3 * k] * size, q[3 * k + 1] * size, q[3 * k + 2]];
  }

  place(reference) {
    const [x, y, angle] = this.frame(bodyOf(reference)), [u, v] = this.mechanism.pointsOf(bodyOf(reference)).get(pointOf(reference));
    return [x + Math.cos(angle) * u - Math.sin(angle) * v, y + Math.sin(angle) * u + Math.cos(angle) * v];
  }

  /** A place in the frame of a body. */
  local(body, [x, y], frame = this.frame(body)) {
    const [u, v] = [x - frame[0], y - frame[1]], [c, s] = [Math.cos(frame[2]), Math.sin(frame[2])];
    return [c * u + s * v, c * v - s * u];
  }

  places() { return Object.fromEntries([["ground", this.mechanism.ground], ...this.mechanism.bodies.map(({ name, points }) => [name, points])].flatMap(([body, points]) => [...points.keys()].map((name) => [`${body}.${name}`, this.place(`${body}.${name}`)]))); }

  get freedom() { return mobility(this.pose.rows, this.pose.q); }

  /** Lengths are rounded to this: about 1e-4 of what is seen. */
  get step() { return 10 ** (Math.floor(Math.log10(this.seen)) - 4); }

  rounded(value) { return Math.round(value / this.step) * this.step; }

  /** The roundest number near: rounded lengths and angles have moved the point by as much. */
  roundest(value) {
    const unit = [3, 2, 1].map((k) => this.step * 10 ** k).find((own) => Math.abs(Math.round(value / own) * own - value) < 2 * this.step) || this.step;
    return Math.round(value / unit) * unit;
  }

  // -- gestures

  /**
   * Change the text, close the links again near where they are and note the pose in the sketch; on a refusal nothing has changed.
   * `frames`: places of bodies that the change gives, by name. `strict`: what does not close any more is refused.
   */
  change(act, { strict = false, during = false } = {}) {
    const { text, toml, mechanism, pose } = this, was = { text, shut: pose.shut, flat: strict && this.flat };
    const near = new Map(mechanism.bodies.map(({ name }) => [name, this.frame(name)]));
    this.toml = toml;
    try {
      const frames = act() || new Map();
      this.forget(mechanism);
      for (const [name, own] of frames) near.set(name, own);
      this.load(this.toml.text, near);
      if (strict && was.shut && !this.pose.shut) throw new Refused("does_not_close", 0, this.pose.open);
      if (strict && this.flat > was.flat) throw new Refused("zero_length");
      if (this.pose.shut) this.note();
    } catch (error) {
      this.load(was.text, near);
      throw error;
    }
    if (!during) this.done();
  }

  /** End a gesture that was changed on the way. */
  done() {
    if (this.text === this.kept) return;
    this.before.push(this.kept);
    this.after = [];
    this.kept = this.text;
  }

  undo(back) {
    const [from, to] = back ? [this.before, this.after] : [this.after, this.before];
    if (!from.length) return false;
    to.push(this.kept);
    this.kept = from.pop();
    this.load(this.kept);
    return true;
  }

  /** Write the pose into the sketch: angles of links, slides that drive. */
  note() {
    const { mechanism, toml, numbers } = this, sketch = numbers.table(["sketch"]);
    const meshed = new Set(mechanism.joints.filter(({ ratio }) => ratio).flatMap(({ first, second }) => [first, second].map(bodyOf)));
    const driven = new Set(mechanism.drivers.map(({ owner }) => owner));
    const wanted = [];
    for (const { name, points } of mechanism.bodies) {
      const pin = mechanism.joints.find((own) => own.kind === "revolute" && bodyOf(own.first) === "ground" && bodyOf(own.second) === name && sketch.has(own.name));
      if (points.size > 1 || meshed.has(name) || driven.has(name) || sketch.has(name)) wanted.push([pin && !sketch.has(name) ? pin.name : name, this.frame(name)[2], true]);
    }
    for (const { name, kind, drawn } of mechanism.joints) if (drawn && ["prismatic", "pin-in-slot"].includes(kind) && (sketch.has(name) || driven.has(name))) wanted.push([name, this.value(`${name}.slide`), false]);
    for (const [name, value, angle] of wanted) {
      const known = [...sketch].find(([key]) => ownerOf(key) === name), near = angle ? 0.05 * DEGREE : this.step;
      if (known && Math.abs(mechanism.sketch.get(name) - value) < near) continue;
      if (known) toml.set(known[1].path, numeral(Number((value / numbers.unit(known[1].suffix)).toPrecision(6))));
      else this.sketched(name, value, angle);
    }
    if (toml.text !== this.text) this.load(toml.text, new Map(mechanism.bodies.map(({ name }) => [name, this.frame(name)])));
  }

  /** A number of a load in the drawn pose, in SI: of its key, or of an entry there. */
  amount(load, key, entry = null) {
    const { path, suffix } = load.places.get(key), value = (name) => this.value(name) ?? NaN;
    return this.mechanism.amount({ path: entry === null ? path : [...path, entry], suffix }, value);
  }

  /** The value of a coordinate in the drawn pose, in SI; null for one that is not known. */
  value(coordinate) {
    const row = this.pose.rows.coordinate(coordinate);
    return row && new Place(this.pose.q).value(row) * row.unit;
  }

  // -- names and numbers of new parts

  get names() { return new Set([...this.mechanism.bodies, ...this.mechanism.joints].map(({ name }) => name)); }

  free(word, from = 1, names = this.names) {
    let k = from;
    while (names.has(`${word}${k}`)) k += 1;
    return `${word}${k}`;
  }

  letter() {
    const taken = new Set([...this.nodes.flatMap(({ refs }) => refs.map(pointOf)), ...this.names, ...this.letters]);
    for (let k = 0; ; k += 1) {
      const name = String.fromCharCode(65 + (k % 26)) + (k < 26 ? "" : Math.floor(k / 26));
      if (!taken.has(name)) { this.letters.add(name); return name; }
    }
  }

  /** Letters that were given in this gesture. */
  get letters() { if (this.lettered !== this.mechanism) { this.lettered = this.mechanism; this.given = new Set(); } return this.given; }

  /** A new parameter with a length; the text that stands for it. */
  parameter(name, value) {
    let own = name;
    for (let k = 2; this.numbers.parameter(own); k += 1) own = `${name}_${k}`;
    this.toml.set(["parameters", `${own}_mm`], this.inMillimetres(value));
    return quoted(own);
  }

  inMillimetres(value) { return numeral(1000 * this.rounded(value)); }

  /** An angle in degrees or a length in millimetres. */
  written(value, angle) { return angle ? inDegrees(value) : this.inMillimetres(value); }

  /** Write the angle or slide of a coordinate's owner into the sketch. */
  sketched(owner, value, angle) { this.toml.set(["sketch", `${owner}${angle ? "_deg" : "_mm"}`], this.written(value, angle)); }

  point(body, name, [x, y], lengths = `${body}_${name}`) {
    const text = body !== "ground" && Math.hypot(x, y) < this.step / 2 ? "[0, 0]" : `[${this.parameter(`${lengths}_x`, x)}, ${this.parameter(`${lengths}_y`, y)}]`;
    const path = body === "ground" ? ["ground"] : ["bodies", body], known = this.numbers.table(path).get("points");
    if (known) this.toml.set([...known.path, name], text);
    else this.toml.set([...path, "points"], `{ ${name} = ${text} }`);
    return `${body}.${name}`;
  }

  grounded(place, name = this.letter()) {
    return this.point("ground", name, place.map((value) => this.roundest(value)), name);
  }

  get nextNumber() { return String(1 + Math.max(0, ...Object.values(this.toml.data.bodies || {}).map((own) => own.number || 0))); }

  body(name, points) {
    this.toml.set(["bodies", name, "number"], this.nextNumber);
    this.toml.set(["bodies", name, "points"], `{ ${points} }`);
  }

  join(name, kind, first, second, more = "") {
    let own = name;
    const taken = new Set([...Object.keys(this.toml.data.joints || {}), ...Object.keys(this.toml.data.bodies || {})]);
    for (let k = 2; taken.has(own); k += 1) own = `${name}_${k}`;
    this.toml.set(["joints", own], `{ kind = "${kind}", between = ["${first}", "${second}"]${more} }`);
    return own;
  }

  /** A link between two ends, each a point that is there or a place. @returns its name */
  link(a, b) {
    const name = this.free("link"), [one, two] = [a, b].map((end) => (end.reference ? this.place(end.reference) : end.place));
    const long = this.rounded(Math.hypot(two[0] - one[0], two[1] - one[1]));
    if (!(long > 0)) throw new Refused("zero_length");
    const letters = [a, b].map((end) => (end.reference ? pointOf(end.reference) : this.letter()));
    if (letters[0] === letters[1]) letters[1] = this.letter();
    const length = this.parameter(`${name}_${letters[0]}${letters[1]}`, long);
    this.body(name, `${letters[0]} = [0, 0], ${letters[1]} = [${length}, 0]`);
    [a, b].forEach((end, k) => { if (end.reference) this.join(letters[k], "revolute", end.reference, `${name}.${letters[k]}`); });
    const angle = Math.atan2(two[1] - one[1], two[0] - one[0]);
    this.toml.set(["sketch", `${name}_deg`], inDegrees(angle));
    return { name, ends: letters.map((own) => `${name}.${own}`), frames: new Map([[name, [...one, angle]]]) };
  }

  /** Fix a node to the ground, or let it go. */
  pivot(node) {
    if (!node.fixed) {
      const ground = this.grounded([node.x, node.y], node.name);
      this.join(node.name, "revolute", ground, node.id);
      return;
    }
    const held = this.mechanism.joints.filter(({ kind, first }) => LINKED.includes(kind) && first === node.id);
    const [one, ...others] = held;
    if (one) this.toml.drop(["joints", one.name]);
    for (const { name } of others) this.toml.set(["joints", name, "between", 0], quoted(one.second));
    this.dropLone(node.id);
  }

  /** Let a node slide on the ground along a direction; without one it does not slide any more. */
  slider(node, angle) {
    if (node.guide) {
      const body = bodyOf(node.guide.second);
      if (angle === null) this.removeBody(body);
      else this.numbers.write(this.keyed(["joints", node.guide.name], "axis", "_deg"), angle);
      return;
    }
    if (angle === null) return;
    if (node.fixed) { this.pivot(node); }
    const carried = node.fixed ? node.refs.find((own) => !own.startsWith("ground.")) : node.id;
    const ground = this.grounded([node.x, node.y], node.name), block = this.free(`slider_${node.name}`, "");
    this.body(block, `${node.name} = [0, 0]`);
    if (carried) this.join(`pin_${node.name}`, "revolute", carried, `${block}.${node.name}`);
    this.join(`guide_${node.name}`, "prismatic", ground, `${block}.${node.name}`, `, axis_deg = ${inDegrees(angle)}`);
    return new Map([[block, [node.x, node.y, 0]]]);
  }

  /** A key of a table, written as 0 where it is absent: its place and suffix. */
  keyed(path, key, suffix) {
    const known = this.numbers.table(path).get(key);
    if (!known) this.toml.set([...path, `${key}${suffix}`], "0");
    return known || { path: [...path, `${key}${suffix}`], suffix };
  }

  /** Let a node slide in a link along the line of its first two points; again, and it is free. */
  slot(node, body) {
    const known = this.mechanism.joints.find(({ kind, first, second }) => kind === "pin-in-slot" && bodyOf(first) === body && node.refs.includes(second));
    if (known) { this.toml.drop(["joints", known.name]); return; }
    const points = [...this.mechanism.pointsOf(body)], [[name, [x, y]], [, [u, v]]] = points;
    if (node.refs.some((own) => bodyOf(own) === body)) throw new Refused("own_point");
    this.join(`slot_${node.name}`, "pin-in-slot", `${body}.${name}`, node.id, `, axis_deg = ${inDegrees(Math.atan2(v - y, u - x))}`);
  }

  /** Let the links of a node turn together; again, and they are free. */
  weld(node) {
    const own = this.mechanism.joints.filter(({ kind, first, second }) => LINKED.includes(kind) && node.refs.includes(first) && node.refs.includes(second));
    if (!own.length) throw new Refused("nothing_to_weld");
    const welded = own.some(({ kind }) => kind === "weld");
    for (const joint of own) {
      this.toml.set(["joints", joint.name, "kind"], welded ? '"revolute"' : '"weld"');
      for (const [key, place] of joint.places) if (key === "turn") this.toml.drop(place.path);
      if (!welded) this.toml.set(["joints", joint.name, "turn_deg"], inDegrees(this.frame(bodyOf(joint.second))[2] - this.frame(bodyOf(joint.first))[2]));
    }
  }

  /** Refuse two nodes of one link. */
  unlinked(a, b) { if (a.refs.some((own) => b.refs.some((other) => bodyOf(own) === bodyOf(other)))) throw new Refused("own_point"); }

  /** How far two nodes of different links are from each other. */
  apart(a, b) {
    this.unlinked(a, b);
    const long = Math.hypot(b.x - a.x, b.y - a.y);
    if (!(long > this.step)) throw new Refused("zero_length");
    return long;
  }

  /** A bar of constant length between two nodes; again, and it is gone. */
  bar(a, b) {
    const known = this.mechanism.joints.find(({ kind, first, second }) => kind === "distance" && [a, b].every((node) => node.refs.includes(first) || node.refs.includes(second)));
    if (known) { this.removeJoint(known.name); return; }
    const long = this.apart(a, b), name = this.free("bar");
    this.join(name, "distance", a.id, b.id, `, length = ${this.parameter(`${name}_length`, long)}`);
  }

  /** A cylinder between two nodes, which drives. */
  cylinder(a, b) {
    const long = this.apart(a, b), angle = Math.atan2(b.y - a.y, b.x - a.x), tube = this.free("cylinder"), rod = tube.replace("cylinder", "rod");
    this.body(tube, `${a.name} = [0, 0]`);
    this.body(rod, `${b.name} = [0, 0]`);
    this.join(a.name, "revolute", a.id, `${tube}.${a.name}`);
    this.join(b.name, "revolute", b.id, `${rod}.${b.name}`);
    const guide = this.join(`stroke${tube.slice(8)}`, "prismatic", `${tube}.${a.name}`, `${rod}.${b.name}`);
    for (const body of [tube, rod]) this.sketched(body, angle, true);
    this.sketched(guide, long, false);
    this.lead(`${guide}.slide`, this.rounded(long));
    return new Map([[tube, [a.x, a.y, angle]], [rod, [b.x, b.y, angle]]]);
  }

  /** A pair of wheels about two nodes; a wheel belongs to the link there that does not carry the pair, else it is a new one. */
  gear(a, b, kind = "gear") {
    const ratio = kind === "gear" ? -1 : 1, bodies = (node) => node.refs.map(bodyOf), shared = bodies(a).filter((own) => bodies(b).includes(own));
    const carrier = a.fixed && b.fixed ? "ground" : shared.find((own) => own !== "ground");
    if (!carrier) throw new Refused("no_carrier");
    const frames = new Map(), [first, second] = [a, b].map((node) => this.wheel(node, carrier, frames)), turn = (reference) => (frames.has(bodyOf(reference)) ? 0 : this.frame(bodyOf(reference))[2]), base = this.frame(carrier)[2];
    const phase = frames.size ? 0 : turn(first) - base - ratio * (turn(second) - base);
    if (bodyOf(first) === bodyOf(second)) throw new Refused("own_point");
    this.join(this.free(kind), kind, first, second, `${carrier === "ground" ? "" : `, carrier = "${carrier}"`}, ratio = ${ratio}${phase ? `, phase_deg = ${inDegrees(phase)}` : ""}`);
    return frames;
  }

  /** The point of a wheel about a node: of a link that turns there, else of a new body, which goes into `frames`. */
  wheel(node, carrier, frames) {
    const known = node.refs.find((own) => ![carrier, "ground"].includes(bodyOf(own)) && !this.isBlock(bodyOf(own)));
    if (known) return known;
    const name = this.free(frames.size ? "wheel_" : "wheel");
    this.body(name, `${node.name} = [0, 0]`);
    this.join(`${name}_pin`, "revolute", node.id, `${name}.${node.name}`);
    this.toml.set(["sketch", `${name}_deg`], "0");
    frames.set(name, [node.x, node.y, 0]);
    return `${name}.${node.name}`;
  }

  /** A wheel about a pivot, and a rack on what slides there: as wide as the wheel's centre is away from the slider's line. */
  rack(a, b) {
    if (!a.fixed || !b.guide || bodyOf(b.guide.first) !== "ground") throw new Refused("no_rack");
    const { axis, second } = b.guide, [c, s] = [Math.cos(axis), Math.sin(axis)], [x, y] = [b.x - a.x, b.y - a.y], radius = this.rounded(x * s - y * c);
    if (!radius) throw new Refused("zero_length");
    const frames = new Map(), first = this.wheel(a, "ground", frames), angle = frames.size ? 0 : this.frame(bodyOf(first))[2], name = this.free("rack");
    const turned = axis - this.frame(bodyOf(second))[2], phase = this.rounded(x * c + y * s - radius * angle);
    this.join(name, "rack", first, second, `, radius = ${this.parameter(`${name}_radius`, radius)}, axis_deg = ${inDegrees(turned)}, phase_mm = ${this.inMillimetres(phase)}`);
    return frames;
  }

  /** A disk cam about a pivot, and a roller on a point that moves: as drawn it stands lowest. */
  cam(a, b) {
    const follower = b.refs.find((own) => bodyOf(own) !== "ground");
    if (!a.fixed || b.fixed || !follower) throw new Refused("no_cam");
    const long = this.apart(a, b), angle = Math.atan2(b.y - a.y, b.x - a.x), frames = new Map(), first = this.wheel(a, "ground", frames), body = bodyOf(first), name = this.free("cam"), roller = this.rounded(long / 6);
    if (frames.size) { frames.set(body, [a.x, a.y, angle]); this.sketched(body, angle, true); }
    if (b.guide) this.sketched(b.guide.name, this.value(`${b.guide.name}.slide`), false); // tells which side of the cam
    for (const [key, value] of [["base", long - roller], ["lift", long / 4], ["roller", roller]]) this.parameter(`${name}_${key}`, value);
    const [x, y] = ["cos", "sin"].map((turn) => quoted(`(${name}_base + ${name}_lift*(1 - cos(s))/2)*${turn}(s)`));
    this.join(name, "curve", first, follower, `, closed = true, roller_radius = "${name}_roller", x = ${x}, y = ${y}`);
    if (!this.mechanism.drivers.length) drive(this, [`${body}.angle`], new Map([[`${body}.angle`, angle]]));
    return frames;
  }

  /** The same link again beside itself, with its masses and without its joints. */
  copied(body) {
    const { points } = this.mechanism.byName.get(body), name = this.free("link"), [x, y, angle] = this.frame(body), path = ["bodies", body];
    const number = (value, word) => (Math.abs(value) < this.step / 2 ? "0" : this.parameter(word, value));
    this.body(name, [...points].map(([own, [u, v]]) => { const letter = this.letter(); return `${letter} = [${number(u, `${name}_${letter}_x`)}, ${number(v, `${name}_${letter}_y`)}]`; }).join(", "));
    for (const key of Object.keys(this.toml.get(path))) if (!["points", "number"].includes(key)) this.toml.set(["bodies", name, key], JSON.stringify(this.toml.get([...path, key])));
    this.toml.set(["sketch", `${name}_deg`], inDegrees(angle));
    return new Map([[name, [x + 0.1 * this.seen, y - 0.1 * this.seen, angle]]]);
  }

  spring(a, b) {
    const long = this.apart(a, b);
    this.loaded("spring", `{ kind = "spring", between = ["${a.id}", "${b.id}"], stiffness = 1000, free_length_mm = ${this.inMillimetres(long)} }`);
  }

  force({ refs }, [x, y]) {
    const point = refs.find((own) => bodyOf(own) !== "ground");
    if (!point) throw new Refused("no_force");
    this.loaded("force", `{ kind = "force", point = "${point}", value = [${numeral(x)}, ${numeral(y)}] }`);
  }

  loaded(word, text) {
    this.toml.set(["loads", this.free(word, 1, new Set(Object.keys(this.toml.data.loads || {})))], text);
    drive(this, this.mechanism.drivers.map(({ name }) => name));
  }

  // -- drivers

  /** Drive a coordinate, or no longer. */
  lead(coordinate, value = this.value(coordinate)) {
    const led = this.mechanism.drivers.map(({ name }) => name), next = led.includes(coordinate) ? led.filter((own) => own !== coordinate) : [...led, coordinate];
    drive(this, next, new Map([[coordinate, value]]));
  }

  // -- moving

  /** Where a node can be moved to, near a place: on its guide or slot, at locked lengths. */
  reachable(node, [x, y]) {
    let place = [x, y];
    const onLine = ([ox, oy], angle) => { const t = (place[0] - ox) * Math.cos(angle) + (place[1] - oy) * Math.sin(angle); place = [ox + t * Math.cos(angle), oy + t * Math.sin(angle)]; };
    for (const { kind, first, second, axis, drawn } of this.mechanism.joints) {
      if (!drawn || !node.refs.includes(second)) continue;
      const base = bodyOf(first), shared = base !== "ground" || this.mechanism.joints.filter((own) => own.first === first || own.second === first).length > 1;
      if (kind === "pin-in-slot" || (kind === "prismatic" && this.isBlock(bodyOf(second)) && shared)) onLine(this.place(first), this.frame(base)[2] + axis);
    }
    const rings = this.links.flatMap(({ name }) => this.lengths(name)).filter(({ locked, from, to }) => locked && node.refs.some((own) => own === from || own === to))
      .map(({ from, to, value }) => ({ from: this.place(node.refs.includes(from) ? to : from), value }));
    for (let round = 0; round < 60 && rings.length; round += 1) {
      for (const { from: [u, v], value } of rings) {
        const far = Math.hypot(place[0] - u, place[1] - v) || 1;
        place = [u + ((place[0] - u) * value) / far, v + ((place[1] - v) * value) / far];
      }
    }
    const held = rings.some(({ from: [u, v], value }) => Math.abs(Math.hypot(place[0] - u, place[1] - v) - value) > this.step);
    return held ? [node.x, node.y] : place;
  }

  /** Put a node elsewhere: its points change their places in their links. */
  move(node, to) {
    const place = this.reachable(node, to), frames = new Map(), { mechanism } = this;
    for (const reference of node.refs) {
      const body = bodyOf(reference), name = pointOf(reference);
      if (body === "ground") { this.write(reference, place); continue; }
      const points = [...mechanism.pointsOf(body)];
      if (points.length === 1) { const [, , angle] = this.frame(body); frames.set(body, [place[0], place[1], angle]); this.write(reference, [0, 0], [0, 0]); continue; }
      const world = new Map(points.map(([own]) => [own, own === name ? place : this.place(`${body}.${own}`)]));
      const [[, [x0, y0]], [, [, y1]]] = points, [one, two] = points.map(([own]) => world.get(own));
      const straight = x0 === 0 && y0 === 0 && y1 === 0 && points[1][1][0] > 0;
      const frame = straight ? [...one, Math.atan2(two[1] - one[1], two[0] - one[0])] : this.frame(body);
      if (straight && Math.hypot(two[0] - one[0], two[1] - one[1]) < this.step) throw new Refused("zero_length");
      frames.set(body, frame);
      for (const [own] of points) if (own === name || straight) this.write(`${body}.${own}`, this.local(body, world.get(own), frame));
    }
    for (const joint of mechanism.joints) this.follow(joint, node, place, frames);
    return frames;
  }

  /** Numbers of joints that a moved node takes with it: guides across their line, welds, bars, wheels. */
  follow(joint, node, place, frames) {
    const { kind, first, second, axis, drawn, name } = joint;
    if (!drawn) return;
    const at = (reference) => (node.refs.includes(reference) ? place : this.place(reference));
    if (kind === "prismatic" && bodyOf(first) === "ground" && node.refs.includes(second) && !node.refs.includes(first)) {
      const [x, y] = this.place(first), across = (place[1] - y) * Math.cos(axis) - (place[0] - x) * Math.sin(axis);
      if (Math.abs(across) > this.step / 2) this.write(first, [x - across * Math.sin(axis), y + across * Math.cos(axis)]);
    }
    if (kind === "distance" && [first, second].some((own) => node.refs.includes(own))) this.numbers.write(joint.places.get("length"), this.rounded(Math.hypot(at(second)[0] - at(first)[0], at(second)[1] - at(first)[1])));
    const [a, b] = [first, second].map(bodyOf);
    if (kind === "prismatic" && [a, b].every((own) => this.mechanism.pointsOf(own).size === 1) && a !== "ground" && [first, second].some((own) => node.refs.includes(own))) { // a cylinder
      const angle = Math.atan2(at(second)[1] - at(first)[1], at(second)[0] - at(first)[0]);
      frames.set(a, [...at(first), angle]);
      frames.set(b, [...at(second), angle]);
    }
    if (![a, b].some((own) => frames.has(own))) return;
    const turn = (own) => (frames.get(own) || this.frame(own))[2];
    if (kind === "weld") this.numbers.write(this.keyed(["joints", name], "turn", "_deg"), Math.round((100 * (turn(b) - turn(a))) / DEGREE) * 0.01 * DEGREE);
    const wide = (own) => this.mechanism.pointsOf(own).size > 1;
    if (joint.ratio && wide(a) && wide(b)) {
      const c = turn(joint.carrier), phase = turn(a) - c - joint.ratio * (turn(b) - c);
      this.numbers.write(this.keyed(["joints", name], "phase", "_deg"), Math.round((100 * phase) / DEGREE) * 0.01 * DEGREE);
    }
  }

  /** Write the coordinates of a point where they differ. */
  write(reference, place, was = this.mechanism.pointsOf(bodyOf(reference)).get(pointOf(reference))) {
    const { at } = this.mechanism.places.get(reference);
    place.forEach((value, k) => { if (Math.abs(value - was[k]) > this.step / 2) this.numbers.write(at[k], this.rounded(value)); });
  }

  // -- lengths

  /** Lengths of a link between its points: the side of its first two, of others the ways to both. */
  lengths(body) {
    const points = [...this.mechanism.pointsOf(body)], found = [];
    points.forEach(([to, [x, y]], j) => {
      for (let i = 0; i < Math.min(j, 2); i += 1) {
        const [from, [u, v]] = points[i], value = Math.hypot(x - u, y - v);
        found.push({ body, name: `${from}${to}`, from: `${body}.${from}`, to: `${body}.${to}`, value, locked: this.lockOf(body).includes(`${from}${to}`) });
      }
    });
    return found;
  }

  /** Lengths of a link that are locked, as the comment of its line says. */
  lockOf(body) {
    const place = this.numbers.table(["bodies", body]).get("points"), said = place && this.toml.span(place.path) ? this.toml.comment(place.path) : "";
    const found = said.match(/(?:^|; )locked: ([\w, ]+)/);
    return found ? found[1].split(/, ?/) : [];
  }

  /** Hold a length while points are moved, or no longer: a comment in the file says so. */
  lock(body, name) {
    const { path } = this.numbers.table(["bodies", body]).get("points"), said = this.toml.comment(path).replace(/(?:^|; )locked: [\w, ]+$/, "");
    const held = this.lockOf(body), next = held.includes(name) ? held.filter((own) => own !== name) : [...held, name];
    this.toml.say(path, [said, next.length ? `${LOCKED}: ${next.join(", ")}` : ""].filter(Boolean).join("; "));
  }

  /** Give a length: the second point moves along the way between the two, exactly as far as is typed. */
  resize({ body, from, to }, value) {
    if (!(value > 0)) throw new Refused("zero_length");
    const points = this.mechanism.pointsOf(body), [a, b] = [from, to].map((own) => points.get(pointOf(own))), long = Math.hypot(b[0] - a[0], b[1] - a[1]) || 1;
    const { at } = this.mechanism.places.get(to);
    const next = b.map((own, k) => (b[1 - k] === a[1 - k] && own > a[k] ? a[k] + value : a[k] + ((own - a[k]) * value) / long));
    next.forEach((own, k) => { if (own !== b[k]) this.numbers.write(at[k], own); });
  }

  // -- taking away

  dropPoint(reference) {
    const { path } = this.mechanism.places.get(reference), text = JSON.stringify(this.toml.get(path));
    this.toml.drop(path);
    this.dropUnused(text);
  }

  /** Parameters that only what is gone has used. */
  dropUnused(text) {
    for (const name of this.numbers.namesIn(text)) {
      const place = this.numbers.parameter(name);
      const others = place && JSON.stringify({ ...this.toml.data, parameters: Object.entries(this.toml.data.parameters).filter(([key]) => key !== place.path[1]).map(([, own]) => own) });
      if (place && !new RegExp(`\\b${name}\\b`).test(others)) this.toml.drop(place.path);
    }
  }

  removeJoint(name) {
    const text = JSON.stringify(this.toml.get(["joints", name]));
    this.toml.drop(["joints", name]);
    this.dropUnused(text);
  }

  /** What names something that is gone: places in the sketch, drivers, loads, tasks, expected values. @param {any} before the mechanism that was */
  forget({ bodies, joints, places, drivers }) {
    const { toml, numbers } = this, { data } = toml, plain = (name) => name.replace(/\W/g, "\\$&"), known = new Set(["bodies", "joints"].flatMap((key) => Object.keys(data[key] || {})));
    const gone = [...bodies, ...joints].map(({ name }) => name).filter((name) => !known.has(name)), points = [...places].filter(([, { path }]) => toml.get(path) === undefined).map(([reference]) => reference);
    if (!gone.length && !points.length) return;
    const names = gone.map(plain).join("|") || "$^", pattern = new RegExp(`(?<![\\w.])(?:${names})\\.|"(?:body|frame|carrier)":"(?:${names})"|"what":"[^"]*/(?:${names})["/.]|(?<![\\w.])(?:${points.map(plain).join("|") || "$^"})(?!\\w)`);
    const left = drivers.map(({ name }) => name).filter((name) => !pattern.test(name));
    if (left.length < drivers.length) drive(this, left);
    for (const [key, { path }] of numbers.table(["sketch"])) if (gone.includes(key.split(".")[0])) toml.drop(path);
    for (const key of Object.keys(data).filter((own) => !["ground", "bodies", "joints", "parameters", "sizes", "sketch"].includes(own))) {
      const table = toml.get([key]), entries = table && typeof table === "object" ? Object.keys(table).reverse() : [];
      for (const own of entries) {
        const path = [key, Array.isArray(table) ? Number(own) : own], entry = toml.get(path);
        if (pattern.test(JSON.stringify(entry)) || (key === "expected" && !toml.get(["tasks", entry.task]))) if (key === "loads") this.removeLoad(own); else toml.drop(path);
      }
    }
  }

  removeBody(name) {
    const { mechanism, toml } = this;
    if (!toml.get(["bodies", name])) return;
    const gone = mechanism.joints.filter(({ first, second, carrier }) => [bodyOf(first), bodyOf(second), carrier].includes(name)), text = JSON.stringify(toml.get(["bodies", name]));
    for (const joint of gone) if (toml.get(["joints", joint.name])) this.removeJoint(joint.name);
    toml.drop(["bodies", name]);
    this.dropUnused(text);
    // blocks, wheels and rods that hung on it alone
    for (const { first, second } of gone) for (const reference of [first, second]) this.dropLone(reference);
  }

  /** A body of one point without a pin, and a point of the ground that nothing uses any more. */
  dropLone(reference) {
    const body = bodyOf(reference), used = Object.values(this.toml.data.joints || {}).filter(({ between }) => (between || []).some((own) => (body === "ground" ? own === reference : bodyOf(own) === body)));
    if (body === "ground") { if (!used.length && !this.mechanism.loads.some(({ points }) => points.includes(reference)) && this.toml.get(this.mechanism.places.get(reference).path)) this.dropPoint(reference); return; }
    if (this.toml.get(["bodies", body]) && this.mechanism.pointsOf(body).size === 1 && used.filter(({ kind }) => kind === "revolute").length === 0) this.removeBody(body);
  }

  removeLoad(name) {
    this.toml.drop(["loads", name]);
    if (this.toml.get(["tasks", "forces"]) && !Object.keys(this.toml.data.loads || {}).length) this.toml.drop(["tasks", "forces"]);
  }

  /** Remove a node: the points of all links there, and links that have one point left. */
  removeNode(node) {
    for (const reference of node.refs) {
      const body = bodyOf(reference), points = this.mechanism.pointsOf(body);
      if (body !== "ground" && points.size <= 2) { this.removeBody(body); continue; }
      for (const { name, first, second } of this.mechanism.joints) if ([first, second].includes(reference) && this.toml.get(["joints", name])) this.removeJoint(name);
      if (this.toml.get(this.mechanism.places.get(reference).path)) this.dropPoint(reference);
    }
  }

  /** Put one node in the place of another: a pin holds both. */
  merge(node, into) {
    const joint = node.fixed ? [node, into] : [into, node];
    if (node.fixed && into.fixed) throw new Refused("both_fixed");
    this.unlinked(node, into);
    this.join(into.name, "revolute", joint[0].id, joint[1].id);
  }

  // -- names

  /** Another name of a body, joint or point, wherever the file has it. */
  rename(old, name, body = "") {
    if (!/^[A-Za-z_]\w*$/.test(name) || name === "ground" || this.numbers.split(name)[1]) throw new Refused("bad_name", 0, name);
    if (body ? this.mechanism.pointsOf(body).has(name) : this.names.has(name)) throw new Refused("taken", 0, name);
    if (body) {
      const { path } = this.mechanism.places.get(`${body}.${old}`), key = path[path.length - 1], { from, at } = this.toml.span(path);
      this.toml.splice(from, at, this.toml.text.slice(from, at).replace(new RegExp(`${key}(?=["\\s=])`), key.replace(old, name)));
      this.words(new RegExp(`(?<![\\w.])${body}\\.${old}(?![\\w])`, "g"), () => `${body}.${name}`);
      return;
    }
    const spots = ["bodies", "joints", "sketch"].flatMap((table) => [...this.numbers.table([table])].filter(([key]) => key === old || key.startsWith(`${old}.`)).flatMap(([, { path }]) => this.toml.spots(path)));
    for (const [from, to] of spots.sort((one, two) => two[0] - one[0])) this.toml.splice(from, to, this.toml.text.slice(from, to).replace(new RegExp(`(?<![\\w.])((?:(?:bodies|joints|sketch)\\.)?"?)${old}(?=(?:_[a-z]+)?\\b)`), `$1${name}`));
    this.words(new RegExp(`(?<![\\w.])${old}(?=\\.)`, "g"), () => name);
    for (const key of ["carrier", "body", "frame"]) this.words(new RegExp(`(${key}\\s*=\\s*")${old}(?=")`, "g"), (_, head) => head + name);
  }

  /** Replace words of the file that are no comments. */
  words(pattern, by) {
    const lines = this.toml.text.split("\n").map((line) => { const found = line.match(/^((?:[^"'#]|"(?:[^"\\]|\\.)*"|'[^']*')*)(.*)$/s); return found[1].replace(pattern, by) + found[2]; });
    this.toml.become(lines.join("\n"));
  }

  /** Points of the ground that carry nothing. */
  get stray() {
    const { joints, loads } = this.mechanism, used = new Set([...joints.flatMap(({ first, second }) => [first, second]), ...loads.flatMap(({ points }) => points)]);
    return [...this.mechanism.ground.keys()].filter((name) => !used.has(`ground.${name}`));
  }
}
