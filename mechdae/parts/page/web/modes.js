/** The assembly modes beside each other: a click goes over to one. */
import { element } from "./view.js";
import { find, made } from "./made.js";
import { words } from "./words.js";

export class Modes {
  /** @param {any} app @param {HTMLInputElement} faint whether the others are drawn in the diagram too */
  constructor(app, faint) {
    Object.assign(this, { app, faint });
    const label = made("label", { title: words("about_others") }, faint, ` ${words("others")}`);
    this.cards = app.data.modes.map(({ label: name }) => {
      const picture = element("svg", { class: "thumb", "aria-hidden": "true" });
      return { name, picture, card: made("button", { type: "button", class: "card", onclick: () => { const { s } = app.session; if (app.choose(name)) app.want({ s }); } }, picture, made("span", {}, name)) };
    });
    find("modes").append(made("p", { class: "hint" }, words("hint_modes")), label, made("div", { class: "cards" }, ...this.cards.map(({ card }) => card)));
  }

  whole() {
    const { app } = this, { session, diagram } = app;
    const found = new Map(app.otherPoses().map(({ label, pose }) => [label, session.places_of(pose)]));
    found.set(session.mode, app.now());
    const spots = [...found.values()].flatMap((places) => Object.values(places).map((place) => diagram.at(place)));
    const [[left, right], [low, high]] = [0, 1].map((k) => [Math.min(...spots.map((spot) => spot[k])) - 12, Math.max(...spots.map((spot) => spot[k])) + 12]);
    for (const { name, picture, card } of this.cards) {
      const places = found.get(name);
      card.setAttribute("aria-pressed", String(name === session.mode));
      card.disabled = !places;
      card.title = places ? words("go_mode") : words("gone");
      picture.setAttribute("viewBox", `${left} ${low} ${right - left} ${high - low}`);
      picture.replaceChildren(...(places ? diagram.outlines(places) : []).map((d) => element("path", { d, class: "body" })));
    }
  }
}
