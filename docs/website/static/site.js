"use strict";
/* Cards that are filtered and move, live pages that are copied to other pages. */

function made(name, attributes, ...inside) {
  const element = Object.assign(document.createElement(name), attributes);
  element.append(...inside);
  return element;
}

/** Put a field for words, and one for each facet of the cards, above them. */
function filter(grid) {
  const cards = [...grid.children].map((card) => ({ card, facets: JSON.parse(card.dataset.facets), text: card.textContent.toLowerCase() }));
  const names = [...new Set(cards.flatMap(({ facets }) => Object.keys(facets)))];
  if (!names.length) return;
  const words = made("input", { type: "search" });
  const count = made("output", {});
  const fields = names.map((name) => {
    const values = [...new Set(cards.flatMap(({ facets }) => facets[name]))].sort();
    return [name, made("select", { name }, made("option", { value: "" }, "all"), ...values.map((value) => made("option", { value }, value)))];
  });
  const show = () => {
    const wanted = words.value.toLowerCase().split(/\s+/);
    for (const { card, facets, text } of cards) {
      card.hidden = !(wanted.every((word) => text.includes(word)) && fields.every(([name, { value }]) => !value || facets[name].includes(value)));
    }
    count.textContent = `${cards.filter(({ card }) => !card.hidden).length} of ${cards.length}`;
  };
  const form = made("form", { className: "filters", oninput: show, onsubmit: (event) => event.preventDefault() });
  for (const [name, field] of [["words", words], ...fields]) form.append(made("label", {}, name, field));
  form.append(count);
  grid.before(form);
  show();
}

/** Let a card's picture move while it is looked at. */
function move(card) {
  const picture = card.querySelector("img[data-moves]");
  if (!picture || matchMedia("(prefers-reduced-motion: reduce)").matches) return;
  const still = picture.src, moving = still.replace(/\.svg$/, "-moves.svg");
  for (const [events, source] of [["pointerenter focus", moving], ["pointerleave blur", still]]) {
    for (const event of events.split(" ")) card.addEventListener(event, () => { picture.src = source; });
  }
}

/** Offer a live page as it is now: its address, and what a course page has to hold. */
function share(line) {
  const frame = line.previousElementSibling;
  const field = made("input", { readOnly: true, hidden: true, onfocus: () => field.select() });
  const address = () => {
    try { return frame.contentWindow.location.href; } catch { return frame.src; } /* from a folder */
  };
  const offer = (text) => {
    field.hidden = false;
    field.value = text;
    field.focus();
    if (navigator.clipboard) navigator.clipboard.writeText(text).catch(() => {});
  };
  const embedded = () => made("iframe", { src: address(), title: frame.title, width: "100%", height: "640", loading: "lazy" }).outerHTML;
  line.append(
    made("button", { type: "button", onclick: () => offer(address()) }, "Copy link"),
    made("button", { type: "button", onclick: () => offer(embedded()) }, "Embed"),
    field,
  );
}

document.querySelectorAll(".cards").forEach(filter);
document.querySelectorAll(".card").forEach(move);
document.querySelectorAll(".share").forEach(share);
