/** All links of a drawing again, reflected in a line. */
import { bodyOf, pointOf } from "./mechanism.js";
import { numeral } from "./numbers.js";
import { Refused } from "../read_toml.js";
import { DEGREE, inDegrees, quoted } from "./sketch.js";

/** All links again, reflected in a line, which shares its points: dimensions are those of the first half. */
export function reflected(sketch, [x0, y0], angle) {
  const { mechanism, toml, numbers } = sketch, turned = 2 * angle, [c, s] = [Math.cos(turned), Math.sin(turned)];
  const across = ([x, y]) => [x0 + c * (x - x0) + s * (y - y0), y0 + s * (x - x0) - c * (y - y0)];
  const shared = (node) => Math.hypot(...across([node.x, node.y]).map((v, k) => v - [node.x, node.y][k])) < 4 * sketch.step;
  const minus = (value) => (typeof value === "string" ? quoted(`-(${value})`) : numeral(-value)), text = (value) => (typeof value === "string" ? quoted(value) : String(value));
  const letters = new Map(sketch.nodes.map((node) => [node, shared(node) ? node.name : sketch.letter()])), frames = new Map(), twins = new Map([["ground", "ground"]]);
  for (const { name, points } of mechanism.bodies) twins.set(name, [...points.keys()].every((own) => shared(sketch.nodeOf.get(`${name}.${own}`))) ? name : sketch.free(`${name}_`));
  const twin = (reference) => { const body = twins.get(bodyOf(reference)), node = sketch.nodeOf.get(reference); return body === bodyOf(reference) && shared(node) ? reference : `${body}.${letters.get(node)}`; };
  for (const node of sketch.nodes) if (node.fixed && !shared(node)) sketch.grounded(across([node.x, node.y]), letters.get(node));
  const turnOf = (body) => (frames.get(body) || sketch.frame(body))[2];
  /** What makes a reflected pair of wheels fit where it is drawn. */
  const phaseOf = ({ first, second, ratio, radius, axis = 0 }, [a, b, c], change) => {
    if (ratio !== undefined) return `phase_deg = ${numeral((a - ratio * b + (ratio - 1) * c) / DEGREE)}`;
    const [[x, y], [u, v]] = [first, second].map((own) => across(sketch.place(own))), way = b + change.axis - axis;
    return `phase_mm = ${numeral(1000 * ((u - x) * Math.cos(way) + (v - y) * Math.sin(way) + radius * (a - c)))}`;
  };
  for (const { name } of mechanism.bodies) {
    const other = twins.get(name), path = ["bodies", name], [x, y, own] = sketch.frame(name);
    if (other === name) continue;
    const { points, center } = Object.fromEntries(numbers.table(path)), entries = Object.entries(toml.get(points.path));
    const pair = ([u, v]) => `[${text(u)}, ${minus(v)}]`;
    toml.set(["bodies", other, "number"], sketch.nextNumber);
    toml.set(["bodies", other, points.path[2]], `{ ${entries.map(([key, place]) => { const [point, suffix] = numbers.split(key); return `${letters.get(sketch.nodeOf.get(`${name}.${point}`))}${suffix} = ${pair(place)}`; }).join(", ")} }`);
    for (const [key, value] of Object.entries(toml.get(path))) if (!["number", points.path[2]].includes(key)) toml.set(["bodies", other, key], center && key === center.path[2] ? pair(value) : JSON.stringify(value));
    frames.set(other, [...across([x, y]), turned - own]);
    toml.set(["sketch", `${other}_deg`], inDegrees(turned - own));
  }
  for (const joint of mechanism.joints) {
    const { name, kind, first, second, drawn, places } = joint;
    const [a, b] = [first, second].map(twin), [from, to] = [first, second].map((own) => (bodyOf(own) === "ground" ? turned : 0)), node = sketch.nodeOf.get(first), rack = kind === "rack", wheels = rack || joint.ratio !== undefined;
    if ([first, second].every((own) => twins.get(bodyOf(own)) === bodyOf(own))) continue;
    if (!drawn || kind === "curve") throw new Refused("no_mirror", 0, name);
    if (node.refs.includes(second) && shared(node) && !node.fixed && kind === "revolute") continue;
    const turns = [a, b, twins.get(joint.carrier)].map((own) => turnOf(bodyOf(own))), change = rack ? { axis: turned - sketch.frame(bodyOf(second))[2] - turns[1] } : { axis: from, turn: from - to };
    const more = [...places].filter(([key]) => !["kind", "between", ...(wheels ? ["phase"] : [])].includes(key)).map(([key, { path, suffix }]) => {
      const value = toml.get(path), last = path[path.length - 1];
      if (key in change && (rack || change[key])) return `${key}_deg = ${inDegrees(change[key] - numbers.read(path, suffix))}`;
      return `${last} = ${key in change || (rack && key === "radius") ? minus(value) : JSON.stringify(key === "carrier" ? twins.get(value) : value)}`;
    });
    for (const [key, value] of Object.entries(change)) if (value && joint[key] !== undefined && !places.has(key)) more.push(`${key}_deg = ${inDegrees(value)}`);
    if (wheels) more.push(phaseOf(joint, turns, change));
    sketch.join(wheels ? sketch.free(kind) : bodyOf(a) === "ground" || !letters.has(node) ? pointOf(a) : letters.get(node), kind, a, b, more.map((own) => `, ${own}`).join(""));
  }
  for (const node of sketch.nodes) { // pins between both halves
    const others = shared(node) && !node.fixed ? node.refs.map(twin).filter((own) => !node.refs.includes(own)) : [];
    for (const own of others) sketch.join(node.name, "revolute", node.id, own);
  }
  return frames;
}
