/** Numbers written as expressions, by the same whitelist as in Python: nothing is executed. */
import { Refused } from "./read_toml.js";

const LONGEST = 500;
const KNOWN = Object.fromEntries("sin cos tan asin acos atan atan2 sinh cosh tanh exp log sqrt abs sign min max hypot".split(" ").map((name) => [name, Math[name]]));
const TOKEN = /\s*(?:(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?)|([A-Za-z_][\w.]*)|(\*\*|[-+*/(),]))/y;

/** The value of an expression. @param {string} text @param {(name: string) => number} valueOf @returns {number} */
export function calculated(text, valueOf) {
  const refuse = () => { throw new Refused("no_number", 0, text.slice(0, 60)); };
  if (text.length > LONGEST) refuse();
  const tokens = [];
  for (TOKEN.lastIndex = 0; TOKEN.lastIndex < text.trimEnd().length;) {
    const found = TOKEN.exec(text);
    if (!found) refuse();
    tokens.push(found);
  }
  let k = 0;
  const next = (...marks) => (k < tokens.length && marks.includes(tokens[k][3]) ? tokens[k++][3] : "");
  const atom = () => {
    const [, number, name] = tokens[k] || refuse();
    if (next("(")) { const own = sum(); return next(")") ? own : refuse(); }
    k += 1;
    if (number !== undefined) return Number(number);
    if (name === undefined) refuse();
    if (!next("(")) return name === "pi" ? Math.PI : valueOf(name);
    const list = [sum()];
    while (next(",")) list.push(sum());
    const least = ["atan2", "hypot", "min", "max"].includes(name) ? 2 : 1;
    if (!next(")") || !Object.hasOwn(KNOWN, name) || list.length < least || (list.length > least && name !== "min" && name !== "max")) refuse();
    return KNOWN[name](...list);
  };
  const power = () => { const base = atom(); return next("**") ? base ** signed() : base; };
  const signed = () => { const sign = next("+", "-"); return sign ? (sign === "-" ? -signed() : signed()) : power(); };
  const product = () => {
    let own = signed();
    for (let mark = next("*", "/"); mark; mark = next("*", "/")) { const other = signed(); own = mark === "*" ? own * other : own / other; }
    return own;
  };
  const sum = () => {
    let own = product();
    for (let mark = next("+", "-"); mark; mark = next("+", "-")) { const other = product(); own = mark === "+" ? own + other : own - other; }
    return own;
  };
  const value = sum();
  return k === tokens.length && Number.isFinite(value) ? value : refuse();
}
