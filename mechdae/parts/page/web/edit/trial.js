/** What is drawn, solved: the page's session over the kernels of the drawing, or why there is none. */
import { Machine } from "./machine.js";
import { Session } from "../session.js";
import { loadedBy, Statics } from "./statics.js";

/** @param {any} sketch @returns {{session: any, reason: string}} */
export function trialOf(sketch) {
  const { mechanism, pose, freedom } = sketch, { drivers } = mechanism;
  if (!mechanism.bodies.length) return { session: null, reason: "empty" };
  if (!pose.shut) return { session: null, reason: "open" };
  if (mechanism.partial || mechanism.joints.some(({ drawn }) => !drawn)) return { session: null, reason: "not_drawn" };
  if (!drivers.length) return { session: null, reason: freedom.rank < 1 ? "stiff" : "nodriver" };
  if (!pose.led) return { session: null, reason: "unknown_driver" };
  if (freedom.count !== drivers.length) return { session: null, reason: freedom.count > drivers.length ? "loose" : freedom.count > 0 ? "overdriven" : "stiff" };
  if (freedom.rank !== freedom.count) return { session: null, reason: "redundant" };
  const machine = new Machine(pose.rows, drivers, pose.q);
  if (!machine.starts) return { session: null, reason: "singular" };
  const scene = { dimension: 2, bodies: mechanism.bodies.map(({ name }) => ({ name })), joints: mechanism.joints.filter(({ drawn }) => drawn).map(({ name, kind, first, second }) => ({ name, first, second, pin: kind === "revolute" || kind === "weld" })), ground: [...mechanism.ground.keys()].map((name) => `ground.${name}`), places: [...mechanism.ground.values()] };
  const { data, code } = machine.data(scene);
  data.lesson = { letters: Object.fromEntries(sketch.nodes.flatMap(({ name, refs }) => refs.map((own) => [own, name]))), numbers: Object.fromEntries(mechanism.bodies.map(({ name, number }) => [name, number])), groups: mechanism.bodies.map(({ name }) => ({ name, bodies: [name] })), transmission: [] };
  const session = new Session(data, code), acting = loadedBy(mechanism);
  if (!session.motion.nodes.length || !session.poses.some(({ status }) => status === "ok")) return { session: null, reason: "singular" };
  if (acting.acts) {
    session.forces = new Statics(machine, mechanism, session.motion);
    data.forces = session.forces.data;
  }
  return { session, reason: "", rubs: acting.acts && acting.rubs };
}
