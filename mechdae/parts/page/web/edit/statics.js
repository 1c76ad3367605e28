/** Forces of a drawn mechanism at a pose, without friction: multipliers of its equations, of which those of drivers are efforts. */
import { inverted, Place } from "./rows.js";

export class Statics {
  /** @param {any} machine @param {any} mechanism @param {any} motion of the session */
  constructor(machine, mechanism, motion) { Object.assign(this, { machine, mechanism, motion }); }

  /** What the session tells of forces. */
  get data() {
    const { machine, mechanism } = this, held = ["revolute", "weld", "prismatic", "pin-in-slot", "distance", "curve"];
    const efforts = machine.drivers.map(({ name }) => name);
    return { efforts, units: Object.fromEntries(efforts.map((name, k) => [name, machine.led[k].unit === 1 ? "N m" : "N"])), lossy: [],
      joints: mechanism.joints.filter(({ kind, drawn }) => drawn && held.includes(kind)).map(({ name, second }) => ({ name, at: second })) };
  }

  at(pose) {
    if (!pose.y || pose.status !== "ok") return null;
    const { machine, mechanism } = this, { rows: { size }, n, drivers } = machine, q = Array.from(pose.x), place = new Place(q);
    const found = inverted(machine.matrix(place));
    if (!found) return null;
    const still = drivers.some((own) => own.still), rate = drivers.map(({ speed }) => speed);
    const [v, a] = machine.rates(place, found.rows, rate, drivers.map(({ acceleration }) => acceleration));
    const needed = new Float64Array(n);
    const add = (k, [x, y, u, w], sign) => { // a force at an arm, in units of the size
      if (k < 0) return;
      needed[3 * k] += sign * x;
      needed[3 * k + 1] += sign * y;
      needed[3 * k + 2] += sign * (u * y - w * x);
    };
    mechanism.bodies.forEach(({ mass, inertia, center }, k) => {
      if (!mass && !inertia) return;
      const [, , u, w] = place.of({ k, x: center[0] / size, y: center[1] / size }), own = still ? [0, 0, 0] : [a[3 * k] - a[3 * k + 2] * w - v[3 * k + 2] ** 2 * u, a[3 * k + 1] + a[3 * k + 2] * u - v[3 * k + 2] ** 2 * w, a[3 * k + 2]];
      add(k, [mass * size * (own[0] * size - mechanism.gravity[0]), mass * size * (own[1] * size - mechanism.gravity[1]), u, w], 1);
      needed[3 * k + 2] += inertia * own[2];
    });
    const valueOf = (name) => { const row = machine.rows.coordinate(name); return row ? place.value(row) * row.unit : NaN; };
    for (const load of mechanism.loads) if (load.drawn) this.acting(load, { place, v, valueOf, add, needed });
    // the transposed Jacobian times multipliers is what is needed
    const multipliers = machine.all.map((_, i) => found.rows.reduce((sum, line, j) => sum + line[i] * needed[j], 0));
    const reactions = {}, at = n - machine.led.length;
    machine.all.slice(0, at).forEach((row, i) => {
      const own = reactions[row.name] || (reactions[row.name] = [0, 0, 0]), size2 = multipliers[i] / size;
      if (!row.one) { own[2] += multipliers[i]; return; }
      const [dx, dy, , , , , c, s] = place.parts(row), [x, y] = row.length ? [dx / row.length, dy / row.length] : [c, s];
      own[0] += size2 * x;
      own[1] += size2 * y;
    });
    for (const { name, kind } of mechanism.joints) if (["gear", "belt", "friction-wheel", "rack"].includes(kind)) delete reactions[name];
    const efforts = Object.fromEntries(drivers.map(({ name }, k) => [name, multipliers[at + k] / machine.led[k].unit]));
    return { status: "ok", efforts, reactions, losses: {}, critical: null, still: false };
  }

  /** Take a load off what joints and drivers have to give. */
  acting(load, { place, v, valueOf, add, needed }) {
    const { machine: { rows }, mechanism } = this, { size } = rows, { kind, points, own, places } = load;
    const amount = (path, suffix = "") => mechanism.amount({ path, suffix }, valueOf);
    const number = (key, without = 0) => (places.has(key) ? mechanism.amount(places.get(key), valueOf) : without);
    const along = (row, value) => { const line = place.gradient(row, new Float64Array(needed.length)); line.forEach((slope, j) => { needed[j] -= slope * row.unit * value; }); };
    if (kind === "torque") needed[3 * rows.body(own.body) + 2] -= number("value");
    else if (kind === "force") {
      const { path, suffix } = places.get("value"), point = rows.point(points[0]), [, , u, w] = place.of(point);
      let [x, y] = [0, 1].map((k) => amount([...path, k], suffix));
      if (own.frame && own.frame !== "world") { const [c, s] = place.trig[rows.body(own.frame)]; [x, y] = [c * x - s * y, s * x + c * y]; }
      add(point.k, [x * size, y * size, u, w], -1);
    } else if (kind === "spring" && points.length) {
      const [one, two] = points.map((reference) => rows.point(reference)), [x1, y1, u1, w1] = place.of(one), [x2, y2, u2, w2] = place.of(two);
      const long = Math.hypot(x2 - x1, y2 - y1), pull = number("stiffness") * (long * size - number("free_length")) + number("preload");
      const [x, y] = [((x2 - x1) / long) * pull * size, ((y2 - y1) / long) * pull * size];
      add(one.k, [x, y, u1, w1], -1);
      add(two.k, [-x, -y, u2, w2], -1);
    } else {
      const row = rows.coordinate(String(own.coordinate));
      if (!row) return;
      const value = place.value(row) * row.unit, line = place.gradient(row, new Float64Array(needed.length)), speed = line.reduce((sum, slope, j) => sum + slope * v[j], 0);
      if (kind === "spring") along(row, -(number("stiffness") * (value - number("free_length")) + number("preload")));
      else along(row, speed > 0 ? -number("positive") : number("negative"));
    }
  }
}

/** Whether something acts, and friction that is left out. */
export function loadedBy({ loads, bodies, joints }) {
  return { acts: loads.some(({ drawn }) => drawn) || bodies.some(({ mass }) => mass), rubs: joints.some(({ friction }) => friction) };
}
