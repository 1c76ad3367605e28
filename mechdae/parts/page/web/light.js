/** What is pointed at, or has the focus, lights up wherever else it is drawn. */

let shining = "";
const tellers = [];

/** Let an element light what has the same name. */
export function lightable(own, id) {
  own.setAttribute("data-lit", id);
  own.classList.toggle("lit", id === shining);
  for (const name of ["pointerenter", "focusin"]) own.addEventListener(name, () => light(id));
  for (const name of ["pointerleave", "focusout"]) {
    own.addEventListener(name, () => {
      const held = name === "pointerleave" && document.activeElement ? document.activeElement.closest("[data-lit]") : null;
      light(held ? held.getAttribute("data-lit") : "");
    });
  }
  return own;
}

/** Light what has a name; "" nothing. */
export function light(id) {
  if (id === shining) return;
  shining = id;
  for (const own of document.querySelectorAll("[data-lit]")) own.classList.toggle("lit", own.getAttribute("data-lit") === id);
  for (const tell of tellers) tell(id);
}

/** Tell somebody what is lit. */
export function whenLit(tell) { tellers.push(tell); }

/** Mark what is drawn of some parts with a class: names are kind-part-look, of pins that are one kind-part-part-look. */
export function mark(svg, look, kinds, parts) {
  for (const own of svg.querySelectorAll("[data-id]")) {
    const [kind, ...names] = own.getAttribute("data-id").split("-");
    if (names.length > 1) names.pop();
    own.classList.toggle(look, kinds.includes(kind) && names.some((name) => parts.includes(name)));
  }
}
