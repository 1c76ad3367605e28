/** The problem file of a drawn mechanism. */
import { Draft } from "./draft.js";
import { GROUND_ID } from "./model.js";

/** What stands above the lines of another file that are not drawn. */
export const KEPT = "# of the file that was opened, not drawn here:";

const text = (value) => JSON.stringify(value);
/** Millimetres that are read back as the same number of metres, where there are such. */
const millimetres = (value) => { const own = 1000 * value, step = 0.51 * Number.EPSILON * own; return [own, own + step, own - step].find((near) => near / 1000 === value) ?? own; };
const metres = (value) => text(Number(value) === 0 ? 0 : value);

/** What holds the links of a point: [first body, second, turn of a weld or null]. */
function pinsOf(node, own, draft) {
  const nameOf = (id) => (id === GROUND_ID ? "ground" : draft.links[draft.index.get(id)].name);
  const weldOf = (id) => { const weld = node.welds.find(({ links }) => links.indexOf(id) > 0); return weld ? [nameOf(weld.links[0]), draft.turns(weld)[weld.links.indexOf(id)]] : null; };
  const first = node.fixed ? null : own.find(({ id }) => !weldOf(id));
  return own.filter((link) => link !== first).map((link) => {
    const weld = weldOf(link.id);
    return weld ? [weld[0], link.name, weld[1]] : [first ? first.name : "ground", link.name, null];
  });
}

/** Write the file; `kept` are lines of another file that are not drawn. @param {any} model @param {string} title @param {string[]} kept */
export function problemText(model, title, kept = []) {
  const draft = new Draft(model);
  const parameters = [], bodies = [], joints = [], sketch = [], ground = [];
  const number = (name, value) => { parameters.push(`${name}_mm = ${text(millimetres(value))}`); return text(name); };
  const nodeName = (id) => draft.nodes.get(id).name;
  for (const node of model.nodes) {
    if (node.fixed || node.slide) ground.push(`${node.name} = [${number(`${node.name}_x`, node.x)}, ${number(`${node.name}_y`, node.y)}]`);
  }
  const order = [...draft.links.keys()];
  for (const k of order) {
    const link = draft.links[k];
    const { locals, angle } = draft.frames[k];
    const points = link.nodes.map((id, i) => {
      if (i === 0) return `${nodeName(id)} = [0, 0]`;
      const [x, y] = locals.get(id);
      if (i === 1) return `${nodeName(id)} = [${number(`${link.name}_${nodeName(link.nodes[0])}${nodeName(id)}`, x)}, 0]`;
      return `${nodeName(id)} = [${number(`${link.name}_${nodeName(id)}_x`, x)}, ${number(`${link.name}_${nodeName(id)}_y`, y)}]`;
    });
    bodies.push(`[bodies.${link.name}]\nnumber = ${k + 1}\npoints = { ${points.join(", ")} }`);
    sketch.push(`${link.name} = ${metres(angle)}`);
  }
  for (const node of model.nodes) {
    const own = draft.links.filter((link) => link.nodes.includes(node.id));
    pinsOf(node, own, draft).forEach(([a, b, turn], k) => {
      const kind = turn === null ? 'kind = "revolute"' : 'kind = "weld"';
      joints.push(`${node.name}${k ? `_${k + 1}` : ""} = { ${kind}, between = ["${a}.${node.name}", "${b}.${node.name}"]${turn === null ? "" : `, turn = ${metres(turn)}`} }`);
    });
    if (!own.length) continue;
    if (node.slide) {
      bodies.push(`[bodies.slider_${node.name}]\npoints = { ${node.name} = [0, 0] }`);
      joints.push(`pin_${node.name} = { kind = "revolute", between = ["${own[0].name}.${node.name}", "slider_${node.name}.${node.name}"] }`);
      joints.push(`guide_${node.name} = { kind = "prismatic", between = ["ground.${node.name}", "slider_${node.name}.${node.name}"], axis = ${metres(node.slide.angle)} }`);
    }
    if (node.slot) {
      const link = draft.links[draft.index.get(node.slot.link)];
      joints.push(`slot_${node.name} = { kind = "pin-in-slot", between = ["${link.name}.${nodeName(link.nodes[0])}", "${own[0].name}.${node.name}"], axis = 0 }`);
    }
  }
  for (const bar of model.bars) {
    const [a, b] = bar.ends.map((id) => { const node = draft.nodes.get(id), own = draft.links.find(({ nodes }) => nodes.includes(id)); return `${node.fixed || !own ? "ground" : own.name}.${node.name}`; });
    joints.push(`${bar.name} = { kind = "distance", between = ["${a}", "${b}"], length = ${number(`${bar.name}_length`, draft.length(bar))} }`);
  }
  const lines = ["schema = 1", `title = ${text(title)}`, "", "[parameters]", ...parameters, "", "[ground]", `points = { ${ground.join(", ")} }`, "",
    ...bodies.flatMap((body) => [body, ""]), "[joints]", ...joints, "", "[sketch]", ...sketch];
  if (model.driver) {
    const turn = model.driver.kind === "turn";
    const coordinate = turn ? `${draft.links[draft.index.get(model.driver.link)].name}.angle` : `guide_${nodeName(model.driver.node)}.slide`;
    if (!turn) lines.push(`${coordinate.split(".")[0]} = 0`);
    lines.push("", "[tasks.window]", 'kind = "sweep"', `driver = { coordinate = "${coordinate}", range = "assembled" }`, "poses = 361", "",
      "[tasks.modes]", 'kind = "modes"', `driver = { coordinate = "${coordinate}", at = [${metres(draft.begin)}] }`);
  }
  if (kept.length) lines.push("", KEPT, ...kept.map((line) => `# ${line}`));
  return `${lines.join("\n")}\n`;
}
