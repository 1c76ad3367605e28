/** The mechanism that a problem file describes, as far as the editor draws it: plain numbers in SI. */
import { calculated } from "../arithmetic.js";
import { FULL_TURN } from "../way.js";
import { loopOf } from "./loops.js";
import { FileNumbers } from "./numbers.js";
import { Refused } from "../read_toml.js";

const PLAIN_NAME = /^[A-Za-z_]\w*$/;
/** Numbers of joints, by kind. */
const KEYS = { revolute: [], weld: ["turn"], prismatic: ["axis", "turn"], "pin-in-slot": ["axis"], distance: ["length"],
  gear: ["phase"], belt: ["phase", "radius"], "friction-wheel": ["phase", "radius", "second_radius"], rack: ["axis", "phase", "radius"], curve: ["roller_radius"] };
const ALONG = 180;
const LOADS = ["force", "torque", "resistance", "spring"];
export const bodyOf = (reference) => reference.split(".")[0];
export const pointOf = (reference) => reference.split(".")[1];
/** The joint or body of a coordinate that one value places. */
export const ownerOf = (coordinate) => coordinate.replace(/\.(angle|slide)$/, "");
export const isAngle = (coordinate) => !/\.(slide|x|y)$/.test(coordinate);
/** Where the drivers of a task stand. */
export const driverPaths = (task, { driver, drivers = [] }) => (driver ? [["tasks", task, "driver"]] : drivers.map((_, k) => ["tasks", task, "drivers", k]));
const entriesOf = (table) => (table && typeof table === "object" && !Array.isArray(table) ? Object.entries(table) : []);

export class Mechanism {
  /** @param {any} toml `TomlText` @param {any} units */
  constructor(toml, units) {
    const { data } = toml;
    if ((data.dimension ?? 2) !== 2) throw new Refused("not_planar");
    this.toml = toml;
    this.numbers = new FileNumbers(toml, units);
    /** What the file has and the editor does not draw, by name. */
    this.rest = [...entriesOf(data.sizes).map(([name]) => `sizes.${name}`), ...["repeat", "vectors", "loops", "nodes"].flatMap((key) => entriesOf(data[key]).map(([name]) => `${key}.${name}`))];
    /** Whether bodies or joints are among that. */
    this.partial = entriesOf(data.repeat).some(([, own]) => own.bodies || own.joints);
    this.places = new Map();
    this.ground = this.points(["ground"], "ground");
    this.bodies = entriesOf(data.bodies).map(([name, own]) => this.body(name, own));
    this.byName = new Map(this.bodies.map((body) => [body.name, body]));
    this.joints = entriesOf(data.joints).map(([name, own]) => this.joint(name, own));
    for (const { name, drawn } of this.joints) if (!drawn) this.rest.push(`joints.${name}`);
    this.sketch = new Map([...this.numbers.table(["sketch"])].map(([name, place]) => [ownerOf(name), this.numbers.at(`sketch.${name}`, place)]));
    this.loads = entriesOf(data.loads).map(([name, own]) => this.load(name, own));
    for (const { name, drawn } of this.loads) if (!drawn) this.rest.push(`loads.${name}`);
    this.gravity = Array.isArray(data.gravity) ? [0, 1].map((k) => this.numbers.at("gravity", { path: ["gravity", k], suffix: "" })) : [0, 0];
    this.drivers = this.driving();
  }

  points(path, where) {
    const found = new Map(), place = this.numbers.table(path).get("points");
    if (!place) return found;
    for (const [name, own] of this.numbers.table(place.path)) {
      if (!PLAIN_NAME.test(name)) throw new Refused("bad_name", 0, `${where}.points.${name}`);
      const value = this.toml.get(own.path), suffix = own.suffix || place.suffix;
      if (!Array.isArray(value) || value.length !== 2) throw new Refused("no_number", 0, `${where}.points.${name}`);
      const at = [0, 1].map((k) => ({ path: [...own.path, k], suffix }));
      this.places.set(`${where === "ground" ? where : where.slice(7)}.${name}`, { path: own.path, at });
      found.set(name, at.map((one) => this.numbers.at(`${where}.points.${name}`, one)));
    }
    return found;
  }

  body(name) {
    if (!PLAIN_NAME.test(name) || name === "ground") throw new Refused("bad_name", 0, `bodies.${name}`);
    const path = ["bodies", name], table = this.numbers.table(path);
    const number = (key) => (table.has(key) ? this.numbers.at(`bodies.${name}.${key}`, table.get(key)) : null);
    const center = table.get("center");
    return { name, points: this.points(path, `bodies.${name}`), number: this.toml.get([...path, "number"]), mass: number("mass") || 0, inertia: number("inertia") || 0,
      center: center ? [0, 1].map((k) => this.numbers.at(`bodies.${name}.center`, { path: [...center.path, k], suffix: center.suffix })) : [0, 0] };
  }

  pointsOf(name) { return name === "ground" ? this.ground : (this.byName.get(name) || { points: new Map() }).points; }

  joint(name, own) {
    const [first, second] = Array.isArray(own.between) ? own.between.map(String) : ["", ""], kind = String(own.kind);
    const table = this.numbers.table(["joints", name]), carrier = String(own.carrier ?? "ground");
    const known = [first, second].every((reference) => this.pointsOf(bodyOf(reference)).has(pointOf(reference))) && (carrier === "ground" || this.byName.has(carrier));
    const joint = { name, kind, first, second, carrier, drawn: known && Boolean(KEYS[kind]), friction: table.has("friction") || table.has("mesh_loss"), places: table };
    if (!joint.drawn) return joint;
    for (const key of KEYS[kind]) joint[key] = table.has(key) ? this.numbers.at(`joints.${name}.${key}`, table.get(key)) : 0;
    if (kind === "distance") joint.drawn = joint.length > 0;
    if (kind === "curve") this.curved(joint, own);
    if (kind === "gear") joint.ratio = Array.isArray(own.teeth) ? this.teeth(name, own) : this.ratio(name, table);
    if (kind === "belt") joint.ratio = (own.crossed ? -1 : 1) * this.ratio(name, table);
    if (kind === "friction-wheel") joint.ratio = ((own.contact === "internal" ? 1 : -1) * joint.second_radius) / joint.radius;
    if (joint.ratio === null || (kind === "rack" && !joint.radius)) joint.drawn = false;
    return joint;
  }

  /** Places of a curve in its body, and the loop on which a roller's centre runs; a curve that is no smooth loop is drawn, not solved. */
  curved(joint, { x, y, closed, side }) {
    const { places, roller_radius: roller } = joint, known = new Map(), way = places.get("range");
    const named = (name) => { if (!known.has(name)) known.set(name, this.numbers.named(name)); return known.get(name); };
    joint.drawn = false;
    try {
      const [from, to] = way ? [0, 1].map((k) => this.numbers.read([...way.path, k], way.suffix)) : [0, FULL_TURN];
      const at = (angle) => [x, y].map((text) => calculated(String(text), (name) => (name === "s" ? from + ((to - from) * angle) / FULL_TURN : named(name))));
      joint.curve = Array.from({ length: ALONG + 1 }, (_, k) => at((FULL_TURN * k) / ALONG));
      const loop = closed ? loopOf(at) : null;
      joint.loop = loop && loop.beside(side === "left" ? -roller : roller);
      joint.drawn = Boolean(joint.loop);
    } catch (error) { if (!(error instanceof Refused)) throw error; } // a curve that cannot be calculated everywhere
  }

  ratio(name, table) { return table.has("ratio") ? this.numbers.at(`joints.${name}.ratio`, table.get("ratio")) : null; }

  teeth(name, own) {
    const [one, two] = [0, 1].map((k) => this.numbers.at(`joints.${name}.teeth`, { path: ["joints", name, "teeth", k], suffix: "" }));
    return (own.mesh === "internal" ? two : -two) / one;
  }

  load(name, own) {
    const table = this.numbers.table(["loads", name]), kind = String(own.kind), load = { name, kind, drawn: LOADS.includes(kind) && !own.damping, places: table, own };
    const points = kind === "force" ? [String(own.point)] : kind === "spring" && Array.isArray(own.between) ? own.between.map(String) : [];
    const there = (reference) => this.pointsOf(bodyOf(reference)).has(pointOf(reference));
    load.points = points;
    if (!points.every(there) || (kind === "torque" && !this.byName.has(String(own.body)))) load.drawn = false;
    return load;
  }

  /** A number of a load over coordinates; `valueOf` gives theirs. */
  amount(place, valueOf) { return this.numbers.read(place.path, place.suffix, (name) => (this.numbers.parameter(name) ? this.numbers.named(name) : valueOf(name))); }

  /** Drivers of the first task that has some, or of the editor's where it drives others, with the value at which the drawing stands. */
  driving() {
    const tasks = entriesOf(this.toml.data.tasks), loaded = tasks.filter(([, own]) => own.kind === "reactions");
    const led = tasks.filter(([, own]) => own.driver || own.drivers), names = ([, own]) => (own.drivers || [own.driver]).map(({ coordinate }) => coordinate).join();
    const drawn = led.find(([name]) => name === "window"), named = drawn && names(drawn) !== names(led[0]) ? drawn : led[0];
    if (!named) return [];
    const [task, own] = named;
    const forced = loaded.find(([, other]) => other.driver && own.driver && other.driver.coordinate === own.driver.coordinate);
    return driverPaths(task, own).map((path) => {
      const table = this.numbers.table(path), name = String(this.toml.get([...path, "coordinate"])), owner = ownerOf(name);
      const number = (key, without) => (table.has(key) ? this.numbers.at(`driver ${key}`, table.get(key)) : without);
      const list = table.get("at"), at = list && Array.isArray(this.toml.get(list.path)) && this.toml.get(list.path).length ? { path: [...list.path, 0], suffix: list.suffix } : null;
      const time = this.toml.get([...path, "law"]) !== undefined; // a law over time: its value where it begins
      const begin = time ? this.law(path, table) : at ? this.numbers.at("driver", at) : number("from", 0);
      const rates = forced ? this.numbers.table(["tasks", forced[0], "driver"]) : table;
      const speed = rates.has("speed") ? this.numbers.at("driver speed", rates.get("speed")) : null;
      return { name, owner, task, path, begin, still: Boolean(forced) && speed === null, speed: speed ?? 1, usual: speed === null, acceleration: number("acceleration", 0) };
    });
  }

  law(path, table) {
    const t = table.has("from") ? this.numbers.at("driver", table.get("from")) : 0;
    return calculated(String(this.toml.get([...path, "law"])), (name) => (name === "t" ? t : this.numbers.named(name)));
  }

  /** Largest extent, by which lengths are told apart from nothing. */
  get size() {
    const spans = [this.ground, ...this.bodies.map(({ points }) => points)].map((points) => {
      const all = [...points.values()];
      return Math.max(0, ...[0, 1].map((k) => Math.max(...all.map((own) => own[k])) - Math.min(...all.map((own) => own[k]))).filter(Number.isFinite));
    });
    return Math.max(...spans, ...this.joints.map(({ length }) => length || 0)) || 1;
  }

  /** Points that pins and welds hold together, by the first of them. */
  get nodes() {
    const of = new Map(), root = (own) => { let up = own; while (of.has(up)) up = of.get(up); return up; };
    const all = [["ground", this.ground], ...this.bodies.map(({ name, points }) => [name, points])].flatMap(([body, points]) => [...points.keys()].map((name) => `${body}.${name}`));
    for (const { kind, drawn, first, second } of this.joints) {
      const [a, b] = drawn && ["revolute", "weld"].includes(kind) ? [root(first), root(second)] : [first, first];
      if (a !== b) { if (b.startsWith("ground.")) of.set(a, b); else of.set(b, a); }
    }
    const found = new Map();
    for (const reference of all) { const own = root(reference); if (!found.has(own)) found.set(own, []); found.get(own).push(reference); }
    return [...found.values()].map((refs) => ({ id: refs[0], refs, fixed: refs[0].startsWith("ground.") }));
  }
}
