/** A problem file as text that is edited in place: what an edit does not name stays as it is, byte by byte. */
import { readPlaces } from "../read_toml.js";

const BARE = /^[A-Za-z0-9_-]+$/;
const keyText = (name) => (BARE.test(name) ? name : JSON.stringify(name));

export class TomlText {
  constructor(text) { this.become(text); }

  become(text) { Object.assign(this, readPlaces(text)); }

  /** The value at a path of names and numbers; undefined without one. */
  get(path) { return path.reduce((own, name) => (own === undefined || own === null ? undefined : own[name]), this.data); }

  /** Where a value stands in the text; null for tables with headers and for what is not there. */
  span(path) {
    const outer = this.get(path.slice(0, -1)), own = this.places.get(outer), last = path[path.length - 1];
    return (own && (Array.isArray(own) ? own[last] : own.entries.get(last))) || null;
  }

  /** Where the names of a value stand: its key, or headers and dotted keys of its table. @param {(string | number)[]} path */
  spots(path) {
    const span = this.span(path), value = this.get(path), own = this.places.get(value);
    if (span) return [[span.from, span.at]];
    const inner = Object.keys(value).filter((key) => this.places.get(value[key]) && !this.span([...path, key])).flatMap((key) => this.spots([...path, key]));
    return [...(own && own.heads.length ? own.heads : [...(own ? own.entries.values() : [])]).map(({ from, to, at = to }) => [from, at]), ...inner];
  }

  splice(from, to, text) { this.become(this.text.slice(0, from) + text + this.text.slice(to)); }

  /** Write a value, in the place of the one there or after the last of its table. @param {(string | number)[]} path @param {string} value as TOML */
  set(path, value) {
    const span = this.span(path);
    if (span) { this.splice(span.at, span.to, value); return; }
    const outer = path.slice(0, -1), key = keyText(path[path.length - 1]), table = this.get(outer), own = table && this.places.get(table);
    if (Array.isArray(table)) {
      const last = own[own.length - 1], end = this.span(outer).to - 1;
      if (last) this.splice(last.to, last.to, `, ${value}`); else this.splice(end, end, value);
    } else if (own && own.inline) {
      const last = [...own.entries.values()].pop();
      if (last) this.splice(last.to, last.to, `, ${key} = ${value}`); else this.splice(own.inline.from, own.inline.to, `{ ${key} = ${value} }`);
    } else if (own && own.heads.length) {
      const last = [...own.entries.values()].filter(({ from }) => from > own.heads[0].from && from < own.heads[0].end).pop();
      this.after(last ? last.to : own.heads[0].to, `${key} = ${value}`);
    } else if (own && own.entries.size) { // dotted keys
      const last = [...own.entries.values()].pop(), before = this.text.slice(last.from, last.at);
      this.after(last.to, `${before.slice(0, before.lastIndexOf("."))}.${key} = ${value}`);
    } else if (outer.length) this.section(outer, `${key} = ${value}`);
    else {
      const first = Math.min(this.text.length, ...[...this.places.values()].flatMap(({ heads = [] }) => heads.map(({ from }) => from)));
      this.splice(first, first, `${key} = ${value}\n`);
    }
  }

  /** A line after the line in which something ends. */
  after(at, line) {
    const end = this.text.indexOf("\n", at);
    if (end < 0) this.splice(this.text.length, this.text.length, `\n${line}\n`);
    else this.splice(end, end, `\n${line}`);
  }

  /** A new section: behind the last one of the same kind, else at the end. */
  section(path, line) {
    const heads = [...this.places.values()].flatMap((own) => own.heads || []);
    const same = heads.filter(({ from }) => this.text.slice(from).startsWith(`[${keyText(path[0])}`));
    const last = same.sort((a, b) => a.end - b.end).pop(), text = `[${path.map(keyText).join(".")}]\n${line}\n`;
    if (last) {
      const end = this.text.indexOf("\n", last.end), at = end < 0 ? this.text.length : end + 1;
      this.splice(at, at, `${end < 0 ? "\n" : ""}${path.length > 1 ? "" : "\n"}${text}`);
    } else {
      const gap = this.text.endsWith("\n\n") || !this.text ? "" : this.text.endsWith("\n") ? "\n" : "\n\n";
      this.splice(this.text.length, this.text.length, gap + text);
    }
  }

  /** Take a value or a whole table out, with its line. */
  drop(path) {
    const table = this.get(path), own = table && typeof table === "object" && this.places.get(table);
    const span = this.span(path);
    if (span && this.inside(path.slice(0, -1))) { this.dropInside(span); return; }
    if (span) { this.lines(span.from, span.to); return; }
    if (!own) return;
    for (const name of Object.keys(table)) {
      const inner = table[name] && typeof table[name] === "object" && !Array.isArray(table[name]) && !this.span([...path, name]);
      if (inner) { this.drop([...path, name]); this.drop(path); return; } // places are those of the text before
    }
    if (own.heads.length) this.lines(own.heads[0].from, own.heads[0].end);
    else for (const name of Object.keys(table)) this.drop([...path, name]);
  }

  /** Whether the entries of a table or list stand within one line. */
  inside(path) {
    const own = this.places.get(this.get(path));
    return Array.isArray(own) || Boolean(own && own.inline);
  }

  dropInside({ from, at, to }) {
    const begin = from ?? at, before = this.text.slice(0, begin).match(/,\s*$/), after = this.text.slice(to).match(/^\s*,\s*/);
    if (before) this.splice(begin - before[0].length, to, "");
    else this.splice(begin, to + (after ? after[0].length : 0), "");
  }

  lines(from, to) {
    const begin = this.text.lastIndexOf("\n", from - 1) + 1, end = this.text.indexOf("\n", to);
    this.splice(begin, end < 0 ? this.text.length : end + 1, "");
  }

  /** What is said behind a value in its line. */
  comment(path) {
    const span = this.span(path), found = span && this.text.slice(span.to).match(/^[^\n#]*#([^\n]*)/);
    return found ? found[1].trim() : "";
  }

  /** Say something behind a value, or nothing any more. */
  say(path, text) {
    const { to } = this.span(path), found = this.text.slice(to).match(/^[^\n#]*(#[^\n]*)?/);
    this.splice(to, to + found[0].length, text ? `  # ${text}` : "");
  }
}
