/** Elements of the page. */
import { sentence, words } from "./words.js";

export const find = (id) => document.getElementById(id);

/** An HTML element with attributes and children; texts are texts, never markup. */
export function made(name, attributes = {}, ...children) {
  const own = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) own.addEventListener(key.slice(2), value);
    else if (value !== false) own.setAttribute(key, value === true ? "" : String(value));
  }
  own.append(...children);
  return own;
}

/** A row of a table; its cells are texts or elements. */
export const rowOf = (...cells) => made("tr", {}, ...cells.map((cell) => made("td", {}, cell)));

/** A table with words at its head. */
export function tableOf(titles, rows, look = "") {
  const head = made("tr", {}, ...titles.map((title) => made("th", { scope: "col" }, title)));
  return made("table", { class: look || false }, made("thead", {}, head), made("tbody", {}, ...rows));
}

/** A letter as it is written: digits after it are low, A1_3 has two indices. */
export const written = (letter) => letter.replace(/(\p{L})_?(\d+)(?:_(\d+))?/gu, (_, own, one, two) => own + below(one) + (two ? `,${below(two)}` : ""));

const below = (index) => [...index].map((digit) => String.fromCharCode(0x2080 + Number(digit))).join("");

/** A letter that is an index itself: A3 for A_3. */
export const indexed = (letter) => letter.replace(/(\d)_(?=\d)/g, "$1,").replace(/_(?=\d)/g, "");

/** A symbol with indices: low, high; dots of rates are above the letter. */
export function symbol([letter, low, high = ""]) {
  const marks = [...(high ? [made("sup", {}, high)] : []), ...(low ? [made("sub", {}, indexed(low))] : [])];
  const rate = ["\u0307", "\u0308"].indexOf(letter[1]), above = rate < 0 ? [] : [made("span", { class: "dots" }, "\u02d9\u00a8"[rate])];
  return made("span", { class: "symbol" }, made("var", {}, rate < 0 ? letter : letter[0], ...above), ...(marks.length > 1 ? [made("span", { class: "marks" }, ...marks)] : marks));
}

/** A number of a form: a comma stands for a point too. */
export const numberIn = (text) => (text.trim() === "" ? NaN : Number(text.replace(",", ".").replace("\u2212", "-")));

/** Do something with the number that was typed, or say that it is none. */
export function typed(text, act, say) {
  const value = numberIn(text);
  if (Number.isFinite(value)) act(value); else say(`"${text}" ${words("nonumber")}`);
}

/** Show what failed unforeseen in the page, once: what it shows from then on may be of before. */
export function showFailures() {
  const place = made("p", { role: "alert", class: "failure", hidden: true });
  document.body.prepend(place);
  for (const kind of ["error", "unhandledrejection"]) {
    window.addEventListener(kind, ({ error, reason }) => {
      if (!place.hidden || !(error || reason)) return;
      place.hidden = false;
      place.textContent = sentence("failed", (error || reason).message || error || reason);
    });
  }
}
