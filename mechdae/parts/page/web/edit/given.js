/** A drawing of places and links as a problem file. */
import { numeral } from "./numbers.js";

/** What numbers of such a file are divided by. */
export const UNITS = { _mm: [1, 1000, false], _deg: [1, 180, true] };

/** Millimetres that are read back as the same number of metres, where there are such. */
const millimetres = (value) => { const own = 1000 * value, step = 0.51 * Number.EPSILON * own; return [own, own + step, own - step].find((near) => near / 1000 === value) ?? own; };

/** @param {any} drawing nodes {id, name, x, y, fixed, slide}, links {name, nodes}, gears [link, link, ratio] on their first points, driver {link} @param {string} title */
export function textOf({ nodes, links, gears = [], driver }, title) {
  const node = new Map(nodes.map((own) => [own.id, own])), parameters = [], bodies = [], joints = [], sketch = [], ground = [], seen = new Map(), turns = new Map();
  const number = (name, value) => { parameters.push(`${name}_mm = ${millimetres(value)}`); return JSON.stringify(name); };
  for (const { name, x, y, fixed, slide } of nodes) if (fixed || slide) ground.push(`${name} = [${number(`${name}_x`, x)}, ${number(`${name}_y`, y)}]`);
  links.forEach(({ name, nodes: ids }, k) => {
    const [a, b] = ids.map((id) => node.get(id)), angle = Math.atan2(b.y - a.y, b.x - a.x), [c, s] = [Math.cos(angle), Math.sin(angle)];
    const points = ids.map((id, j) => {
      const own = node.get(id), [x, y] = [own.x - a.x, own.y - a.y], [u, v] = [c * x + s * y, c * y - s * x];
      if (j < 2) return `${own.name} = [${j ? number(`${name}_${a.name}${own.name}`, u) : 0}, 0]`;
      return `${own.name} = [${number(`${name}_${own.name}_x`, u)}, ${number(`${name}_${own.name}_y`, v)}]`;
    });
    bodies.push(`[bodies.${name}]`, `number = ${k + 1}`, `points = { ${points.join(", ")} }`);
    turns.set(name, angle);
    sketch.push(`${name}_deg = ${numeral((angle * 180) / Math.PI)}`);
    for (const id of ids) {
      const own = node.get(id), first = own.fixed ? "ground" : seen.get(id), count = joints.filter((line) => line.startsWith(`${own.name} `) || line.startsWith(`${own.name}_`)).length;
      if (first) joints.push(`${own.name}${count ? `_${count + 1}` : ""} = { kind = "revolute", between = ["${first}.${own.name}", "${name}.${own.name}"] }`);
      if (!seen.has(id)) seen.set(id, name);
    }
  });
  for (const { id, name, slide } of nodes) {
    if (!slide) continue;
    bodies.push(`[bodies.slider_${name}]`, `points = { ${name} = [0, 0] }`);
    joints.push(`pin_${name} = { kind = "revolute", between = ["${seen.get(id)}.${name}", "slider_${name}.${name}"] }`, `guide_${name} = { kind = "prismatic", between = ["ground.${name}", "slider_${name}.${name}"], axis_deg = ${numeral((slide.angle * 180) / Math.PI)} }`);
  }
  for (const [first, second, ratio] of gears) {
    const ends = [first, second].map((name) => `${name}.${node.get(links.find((own) => own.name === name).nodes[0]).name}`), phase = ((turns.get(first) - ratio * turns.get(second)) * 180) / Math.PI;
    joints.push(`mesh = { kind = "${ratio < 0 ? "gear" : "belt"}", between = ["${ends.join('", "')}"], ratio = ${ratio}, phase_deg = ${numeral(phase)} }`);
  }
  const led = links.find(({ id }) => id === driver.link).name;
  return ["schema = 1", `title = ${JSON.stringify(title)}`, "", "[parameters]", ...parameters, "", "[ground]", `points = { ${ground.join(", ")} }`, "", ...bodies, "", "[joints]", ...joints, "", "[sketch]", ...sketch, "",
    "[tasks.window]", 'kind = "sweep"', `driver = { coordinate = "${led}.angle", range = "assembled" }`, "poses = 361", ""].join("\n");
}
