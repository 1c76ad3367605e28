/** What switches draw over the diagram: instant centres, transmission angles. */
import { element } from "./view.js";
import { written } from "./made.js";
import { quantity } from "./units.js";

/** A centre is drawn so far beside the picture [units]; radius of angles. */
const BESIDE = 400, ARC = 24, LEG = 44, MANY = 6;
/** Where the name of a centre may begin, the first with so much room to the letters; how far names of angles keep from the edge. */
const BEGINS = [[7, -6], [7, 15], [-24, -6], [-24, 15]], ROOM = 16, INSIDE = [40, 12];

/** Instant centres of pairs of bodies: names and place; none where they turn alike. */
function centresOf(session, pose, numbers) {
  const known = new Map([["ground", { place: [0, 0], v: [0, 0], w: 0 }]]);
  const { entries, scene } = session.data;
  for (const { name } of scene.bodies) {
    const turn = entries.find(({ kind, part }) => kind === "bodies" && part === name), point = entries.find(({ kind, part }) => kind === "points" && part.startsWith(`${name}.`));
    const [w, place, v] = [turn && session.inTime(pose, turn.columns, 1), point && session.inTime(pose, point.columns, 0), point && session.inTime(pose, point.columns, 1)];
    if (w && v) known.set(name, { place, v, w: w[0] });
  }
  const bodies = [...known.keys()], found = [], largest = Math.max(...[...known.values()].map(({ w }) => Math.abs(w)));
  bodies.forEach((one, i) => bodies.slice(i + 1).forEach((two) => {
    if (bodies.length > MANY && one !== "ground") return; // of many bodies those with the ground alone
    const [a, b] = [known.get(one), known.get(two)], w = b.w - a.w;
    if (!(Math.abs(w) > 1e-9 * largest)) return;
    // speeds of both bodies in the origin
    const [u, v] = [a, b].map(({ place: [x, y], v: [vx, vy], w: turn }) => [vx + turn * y, vy - turn * x]);
    found.push({ name: `${numbers[one]}${numbers[two]}`, place: [-(v[1] - u[1]) / w, (v[0] - u[0]) / w] });
  }));
  return found;
}

/** Transmission angles of a pose: joint, the angle from 0 to a right one, both lines. */
function transmissionOf(session, pose) {
  const { motion, data } = session, names = data.lesson.transmission;
  if (!names.length || !pose.x || pose.place === null) return [];
  const [rows] = motion.kernels.transmit.run(pose.x, motion.way.u(pose.place), motion.p);
  return names.map((joint, k) => {
    const lines = [rows.slice(4 * k, 4 * k + 2), rows.slice(4 * k + 2, 4 * k + 4)];
    const [[a, b], [c, d]] = lines;
    return { joint, lines, angle: Math.atan2(Math.abs(a * d - b * c), Math.abs(a * c + b * d)) };
  });
}

export class Overlays {
  /** @param {any} app */
  constructor(app) {
    this.app = app;
    this.layer = element("g", { class: "overlays" }, app.diagram.svg);
  }

  frame(pose) {
    const { app, layer } = this;
    if (layer.firstChild) layer.replaceChildren();
    if (!pose.y) return;
    if (app.switches.centres.checked) for (const { name, place } of centresOf(app.session, pose, app.data.lesson.numbers)) this.centre(name, app.diagram.at(place));
    if (app.switches.transmission.checked) for (const own of transmissionOf(app.session, pose)) this.angle(own, app.now());
  }

  centre(name, [x, y]) {
    const { size, elements } = this.app.diagram, letters = (elements || []).flatMap(({ spot }) => (spot ? [spot] : []));
    if (!(x > -BESIDE && y > -BESIDE && x < size[0] + BESIDE && y < size[1] + BESIDE)) return;
    element("path", { d: `M${x - 4} ${y - 4}l8 8m0 -8l-8 8`, class: "centre" }, this.layer);
    element("circle", { cx: x, cy: y, r: 2.4, class: "centre" }, this.layer);
    const [right, down] = BEGINS.find(([u, v]) => letters.every(([a, b]) => Math.hypot(a - x - u - 8, b - y - v + 4) > ROOM)) || BEGINS[0];
    element("text", { x: x + right, y: y + down, class: "centre-name" }, this.layer).textContent = written(`P${name}`);
  }

  angle({ joint, lines, angle }, places) {
    const { diagram, data } = this.app, { second } = data.scene.joints.find(({ name }) => name === joint), place = places[second];
    if (!place) return;
    const [x, y] = diagram.at(place), ways = lines.map(([a, b]) => Math.atan2(-b, a));
    // of the two angles between the lines the acute one
    const apart = Math.cos(ways[1] - ways[0]) < 0 ? ways[1] + Math.PI : ways[1];
    const turn = Math.atan2(Math.sin(apart - ways[0]), Math.cos(apart - ways[0]));
    const middle = (r) => [x, y].map((v, k) => v + r * [Math.cos, Math.sin][k](ways[0] + turn / 2)), far = ARC + 22;
    const side = middle(far).every((v, k) => v > INSIDE[k] && v < diagram.size[k] - INSIDE[k]) ? 1 : -1; // of two angles across the one that is in the picture
    const spot = (way, r) => `${(x + r * Math.cos(way)).toFixed(2)} ${(y + r * Math.sin(way)).toFixed(2)}`;
    element("path", { d: `M${spot(ways[0], -LEG)}L${spot(ways[0], LEG)}M${spot(ways[0] + turn, -LEG)}L${spot(ways[0] + turn, LEG)}`, class: "leg" }, this.layer);
    element("path", { d: `M${spot(ways[0], side * ARC)}A${ARC} ${ARC} 0 0 ${turn > 0 ? 1 : 0} ${spot(ways[0] + turn, side * ARC)}`, class: "angle" }, this.layer);
    const [tx, ty] = middle(side * far);
    element("text", { x: tx, y: ty, class: "angle-name" }, this.layer).textContent = `μ = ${quantity(angle, "rad", 3)}`;
  }
}
