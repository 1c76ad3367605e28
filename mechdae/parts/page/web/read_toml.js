/** Reads the TOML that problem files are written in; what it does not know is refused by its line. */

const ESCAPED = { b: "\b", t: "\t", n: "\n", f: "\f", r: "\r", '"': '"', "\\": "\\" };
const NUMERAL = /[+-]?(?:0|[1-9](?:_?\d)*)(?:\.\d(?:_?\d)*)?(?:[eE][+-]?\d(?:_?\d)*)?(?![^\s,\]}#])/y;
const DEEPEST = 40;

/** What is wrong with a file: a key of the editor's words, the line (0: none), what is named. */
export class Refused extends Error {
  constructor(word, line = 0, about = "") {
    super(word);
    Object.assign(this, { word, line, about });
  }
}

class TomlReader {
  constructor(text) {
    this.text = text.replace(/^\uFEFF/, "").replace(/\r\n/g, "\n");
    this.at = 0;
    this.depth = 0;
    this.headed = new WeakSet();
    this.closed = new WeakSet();
    /** Of each table where it stands: `heads` [from, to, end of its last line], `inline` [from, to], entries by their names. */
    this.places = new Map();
  }

  placeOf(table) {
    if (!this.places.has(table)) this.places.set(table, { heads: [], inline: null, entries: new Map() });
    return this.places.get(table);
  }

  fail(word, about = "") { throw new Refused(word, this.text.slice(0, this.at).split("\n").length, about); }

  take(mark) {
    if (!this.text.startsWith(mark, this.at)) return false;
    this.at += mark.length;
    return true;
  }

  match(pattern) {
    pattern.lastIndex = this.at;
    const found = pattern.exec(this.text);
    if (found) this.at = pattern.lastIndex;
    return found ? found[0] : null;
  }

  space() { this.match(/[ \t]*/y); }

  /** Spaces, ends of lines, comments. */
  blank() { this.match(/(?:[ \t\n]|#[^\n]*)*/y); }

  document() {
    const root = Object.create(null);
    let here = root, head = null;
    for (this.blank(); this.at < this.text.length; this.blank()) {
      const from = this.at;
      if (this.take("[")) {
        const many = this.take("[");
        const path = this.path();
        if (!this.take(many ? "]]" : "]")) this.fail("toml_key");
        here = this.header(root, path, many);
        head = { from, to: this.at, end: this.at };
        this.placeOf(here).heads.push(head);
      } else this.entry(here);
      this.match(/[ \t]*(?:#[^\n]*)?/y);
      if (head) head.end = this.at;
      if (this.at < this.text.length && !this.take("\n")) this.fail("toml_end");
    }
    return root;
  }

  path() {
    const names = [];
    do {
      this.space();
      const quote = this.text[this.at];
      const name = quote === '"' || quote === "'" ? this.string() : this.match(/[A-Za-z0-9_-]+/y);
      if (name === null) this.fail("toml_key");
      names.push(name);
      this.space();
    } while (this.take("."));
    return names;
  }

  /** The table inside of another one, made where it is not there. */
  inside(table, name) {
    if (!(name in table)) table[name] = Object.create(null);
    const own = Array.isArray(table[name]) ? table[name].at(-1) : table[name];
    if (own === null || typeof own !== "object" || Array.isArray(own) || this.closed.has(table[name]) || this.closed.has(own)) this.fail("toml_twice", name);
    return own;
  }

  header(root, path, many) {
    const last = path.pop();
    const table = path.reduce((own, name) => this.inside(own, name), root);
    if (many) {
      if (!(last in table)) table[last] = [];
      if (!Array.isArray(table[last]) || this.closed.has(table[last])) this.fail("toml_twice", last);
      table[last].push(Object.create(null));
      return table[last].at(-1);
    }
    if (Array.isArray(table[last])) this.fail("toml_twice", last);
    const own = this.inside(table, last);
    if (this.headed.has(own)) this.fail("toml_twice", last);
    this.headed.add(own);
    return own;
  }

  entry(table) {
    const from = this.at, path = this.path();
    if (!this.take("=")) this.fail("toml_key");
    const last = path.pop();
    const own = path.reduce((into, name) => this.inside(into, name), table);
    if (last in own) this.fail("toml_twice", last);
    this.space();
    const at = this.at;
    own[last] = this.value();
    this.placeOf(own).entries.set(last, { from, at, to: this.at });
  }

  value() {
    const letter = this.text[this.at];
    if (letter === '"' || letter === "'") return this.string();
    if (letter === "[" || letter === "{") {
      if ((this.depth += 1) > DEEPEST) this.fail("toml_value");
      const own = letter === "[" ? this.array() : this.inline();
      this.depth -= 1;
      this.closed.add(own);
      return own;
    }
    const word = this.match(/(?:true|false)(?![^\s,\]}#])/y);
    if (word) return word === "true";
    const numeral = this.match(NUMERAL);
    if (numeral === null || !Number.isFinite(Number(numeral.replaceAll("_", "")))) this.fail("toml_value");
    return Number(numeral.replaceAll("_", ""));
  }

  array() {
    const list = [], spans = [];
    this.places.set(list, spans);
    this.at += 1;
    for (this.blank(); !this.take("]"); this.blank()) {
      const at = this.at;
      list.push(this.value());
      spans.push({ at, to: this.at });
      this.blank();
      if (!this.take(",") && this.text[this.at] !== "]") this.fail("toml_value");
    }
    return list;
  }

  inline() {
    const table = Object.create(null), inline = { from: this.at, to: 0 };
    this.placeOf(table).inline = inline;
    this.at += 1;
    this.space();
    if (!this.take("}")) {
      do { this.space(); this.entry(table); } while ((this.space(), this.take(",")));
      if (!this.take("}")) this.fail("toml_value");
    }
    inline.to = this.at;
    return table;
  }

  string() {
    if (this.text.startsWith('"""', this.at) || this.text.startsWith("'''", this.at)) this.fail("toml_lines");
    const found = this.match(/'[^'\n]*'|"(?:[^"\\\n]|\\.)*"/y);
    if (found === null) this.fail("toml_string");
    if (found[0] === "'") return found.slice(1, -1);
    return found.slice(1, -1).replace(/\\(u[0-9a-fA-F]{4}|U[0-9a-fA-F]{8}|.)/g, (_, code) => {
      if (code in ESCAPED) return ESCAPED[code];
      if (code.length === 1 || parseInt(code.slice(1), 16) > 0x10FFFF) this.fail("toml_string");
      return String.fromCodePoint(parseInt(code.slice(1), 16));
    });
  }
}

/** Tables of a file. @param {string} text @returns {any} */
export function readToml(text) { return new TomlReader(text).document(); }

/** The same, and where everything stands. */
export function readPlaces(text) {
  const reader = new TomlReader(text), data = reader.document();
  return { text: reader.text, data, places: reader.places };
}
