/** Tasks of a drawing: its way over all that assembles, its modes, its forces. In those of a file only what names other drivers changes. */
import { isAngle, ownerOf } from "./mechanism.js";

const DRAWN = { window: "sweep", modes: "modes", forces: "reactions" }, THIRTY = Math.PI / 6;

const among = (some, all) => some.every((name) => all.includes(name));
/** How many values a driver is given. */
const listed = (driver) => Math.max(0, ...Object.entries(driver).map(([key, list]) => (/^at(_|$)/.test(key) && Array.isArray(list) ? list.length : 0)));

/** Let coordinates drive what is drawn. @param {any} sketch @param {string[]} led @param {Map<string, number>} values where they are, if not as drawn */
export function drive(sketch, led, values = new Map()) {
  const { toml, mechanism: { drivers, bodies } } = sketch, was = drivers.map(({ name }) => name), alone = led.length === 1, same = led.length === was.length && among(was, led);
  const rates = new Map(drivers.map(({ name, path }) => [name, Object.entries(toml.get(path)).filter(([key]) => /^(speed|acceleration)/.test(key)).map(([key, own]) => `, ${key} = ${JSON.stringify(own)}`).join("")]));
  const value = (name) => values.get(name) ?? sketch.value(name), unit = (name) => (isAngle(name) ? "_deg" : "_mm"), number = (name, own = value(name)) => sketch.written(own, isAngle(name));
  const far = (name) => value(name) + (isAngle(name) ? THIRTY : 0.1 * Math.abs(value(name)));
  const range = (name, single) => (single ? 'range = "assembled"' : `from${unit(name)} = ${number(name)}, to${unit(name)} = ${number(name, far(name))}`);
  const entry = (name, single, poses) => `{ coordinate = "${name}", ${poses ? `at${unit(name)} = [${Array(poses).fill(number(name)).join(", ")}]` : `${range(name, single)}${rates.get(name) || ""}`} }`;

  const put = (task) => {
    const path = ["tasks", task], own = toml.get(path), key = own && own.drivers ? "drivers" : "driver", next = alone ? "driver" : "drivers";
    const old = [(own && own[key]) || []].flat(), names = old.map(({ coordinate }) => coordinate), gone = names.filter((name) => was.includes(name) && !led.includes(name));
    if (own && (!names.length || !(gone.length || (names.length === was.length && among(was, names))))) return; // a task of something else
    if (!led.length) { toml.drop(path); return; }
    const poses = Math.max(task === "modes" ? 1 : 0, ...old.map(listed)), span = toml.span([...path, key]);
    if (span && key === next && !alone) { // one after the other, what is said between them stays
      for (let k = names.length - 1; k >= 0; k -= 1) if (gone.includes(names[k])) toml.drop([...path, key, k]);
      for (const name of led) if (!names.includes(name)) toml.set([...path, key, toml.get([...path, key]).length], entry(name, false, poses));
      return;
    }
    const texts = led.map((name) => {
      const k = names.indexOf(name), at = k >= 0 && toml.span(key === "drivers" ? [...path, key, k] : [...path, key]), text = at && toml.text.slice(at.at, at.to);
      return !text || text === entry(name, old.length === 1, poses) ? entry(name, alone, poses) : alone ? text : text.replace(/range\s*=\s*"[^"]*"/, range(name, false));
    });
    const text = alone ? texts[0] : `[\n${texts.map((one) => `  ${one},\n`).join("")}]`;
    if (span) { toml.splice(span.from, span.to, `${next} = ${text}`); return; }
    if (own) toml.drop([...path, key]); else toml.set([...path, "kind"], JSON.stringify(DRAWN[task]));
    toml.set([...path, next], text);
    if (!own && task !== "modes") toml.set([...path, "poses"], "361");
  };

  const loaded = Object.keys(toml.data.loads || {}).length > 0 || bodies.some(({ mass }) => mass);
  const acting = toml.get(["tasks", "forces"]) ? !same : loaded && !Object.values(toml.data.tasks || {}).some(({ kind }) => kind === "reactions");
  for (const task of same ? [] : ["window", "modes"]) if (led.length || toml.get(["tasks", task])) put(task);
  if (acting && (led.length || toml.get(["tasks", "forces"]))) put("forces");
  for (const name of led) {
    const owner = ownerOf(name);
    if (owner !== name && !sketch.numbers.table(["sketch"]).has(owner)) sketch.sketched(owner, value(name), isAngle(name));
  }
}
