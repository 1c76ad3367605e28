/** Kernels from tables of their operations, written as `programs/javascript.py` writes them: functions on one Float64Array. */
const TWO_LETTERS = 16384;

/** The numbers that a string spells, one after the other. */
function spelled(text) {
  let at = 0;
  const letter = () => { const code = text.charCodeAt(at++); return code - (code > 92 ? 36 : 35); };
  return () => { const number = letter(); return number < TWO_LETTERS ? number : (number - TWO_LETTERS) * TWO_LETTERS + letter(); };
}

/** The text of one function; forms are cut where their operands go. */
function functionText(name, { streams, leaves, size }, forms, [part, whole, longest]) {
  const [codes, kinds, first, second, leaf, ways] = streams.map(spelled), count = streams[0].length, pieces = count > whole ? part : count + 1;
  const fixed = leaves.map((own) => (typeof own === "string" ? own : `M[${own}]`)), far = [first, second];
  // of steps: what they do, their operands (values, or ~leaves), where outputs go; of values: how often they are read, in which piece last
  const code = new Uint8Array(count), operands = new Int32Array(2 * count), to = new Int32Array(count), uses = new Int32Array(count), last = new Int32Array(count);
  let made = 0, place = 0;
  for (let k = 0; k < count; k += 1) {
    code[k] = codes();
    const piece = Math.floor(made / pieces), reads = forms[code[k]].length - 1;
    for (let j = 0; j < reads; j += 1) {
      const kind = kinds(), source = kind ? made - (kind < 3 ? kind : far[j]()) : ~leaf();
      operands[2 * k + j] = source;
      if (kind) { uses[source] += 1; last[source] = piece; }
    }
    if (code[k]) last[made++] = piece;
    else {
      const way = ways();
      place += way % 2 ? -(way + 1) / 2 : way / 2;
      to[k] = place;
    }
  }
  const bodies = Array.from({ length: Math.floor(made / pieces) + 1 }, () => []), texts = new Array(made), later = new Array(made), ends = [];
  made = 0;
  for (let k = 0; k < count; k += 1) {
    const piece = Math.floor(made / pieces), form = forms[code[k]], read = (source) => (source < 0 ? fixed[~source] : Math.floor(source / pieces) === piece ? texts[source] : later[source]);
    let text = form[0] + read(operands[2 * k]) + form[1];
    if (form.length > 2) text += read(operands[2 * k + 1]) + form[2];
    if (!code[k]) bodies[piece].push(`M[${to[k]}]=`, text, ";\n");
    else {
      const own = made++;
      if (uses[own] === 1 && last[own] === piece && text.length < longest) texts[own] = text;
      else {
        texts[own] = `v${own}`;
        bodies[piece].push(`const ${texts[own]}=`, text, ";\n");
      }
      if (last[own] > piece) {
        const free = ends.findIndex((end) => end < piece), slot = free < 0 ? ends.length : free;
        ends[slot] = last[own];
        later[own] = `M[${size + slot}]`;
        bodies[piece].push(`${later[own]}=${texts[own]};\n`);
      }
    }
  }
  const calls = bodies.map((_, k) => `${name}_${k}(M);`).join("");
  return `${bodies.map((body, k) => `function ${name}_${k}(M){\n${body.join("")}}\n`).join("")}function ${name}(M){${calls}}\n${name}.size=${size + ends.length};\n`;
}

/** A script that gives the functions of tables by their names. */
export function scriptOf({ functions, forms, limits, helpers }) {
  const cut = forms.map((form) => form.split(/\{\d\}/)), names = Object.keys(functions);
  return `(() => {\n${helpers}${names.map((name) => functionText(name, functions[name], cut, limits)).join("")}return { ${names.join(", ")} };\n})()`;
}
