"""Random gestures on a live page, and what must hold after each of them.

``python -m tests.shared.page_gestures --seed 1 --steps 60 [PROBLEM ...]`` prints what did not.
"""

from __future__ import annotations

import argparse
import itertools
import random
import re
import tempfile
from pathlib import Path

import numpy as np

import mechdae as md
from mechdae.describe.file.library import names
from mechdae.errors import MechdaeError
from tests.shared.browser import ARGUMENTS, CHROMIUM, loaded

TYPED = ("0", "-5", "1e9", "1e-9", "abc", "", "1,5", "--3", "1e400", " 12 ", "1/2", "12 mm", "∞")
FACTORS = (1.05, 0.7, 3.0, -1.0)
KEYS = ("ArrowLeft", "Shift+ArrowRight", "Home", "End", "[", "]", "+", "-", "0", "a", "w", "Tab",
        "Control+z", "Control+Shift+z", "Enter", "Escape")  # fmt: skip
WRONG = re.compile(r"NaN|undefined|\bnull\b|Infinity|\[object")
STATE = """() => {
  const shown = (selector) => [...document.querySelectorAll(selector)].filter((own) => !own.hidden);
  const texts = [document.body.innerText, ...shown("svg text").map((own) => own.textContent)];
  for (const key of ["aria-label", "title", "aria-valuetext"])
    texts.push(...shown(`[${key}]`).map((own) => own.getAttribute(key)));
  const wrong = ({ attributes }) => [...attributes].some(({ value }) => /NaN|undef/.test(value));
  return { pose: mechdae.pose(), toml: mechdae.live === true ? mechdae.toml() : null,
    alert: shown("p[role=alert]").map((own) => own.textContent).join(), texts: texts.join("\\n"),
    odd: shown("svg *").filter(wrong).slice(0, 2).map((own) => own.outerHTML),
    status: document.getElementById("status").innerText,
    wide: document.documentElement.scrollWidth - innerWidth };
}"""
SETTLED = """() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => {
  document.querySelector("#drive button[aria-pressed=true]")?.click(); // it plays no longer
  if (mechdae.live === true) mechdae.limits(); // what comes when the hand rests
  requestAnimationFrame(() => done());
})))"""
SAID = ("is no number", "does not exist there", "has no parameters")
"""What the status tells in place of the pose."""
CLOSE = 1e-9
"""Share of the mechanism that lengths and places may be off."""


class PageGestures:
    """A page, a generator of gestures and the faults that were met, with what was done before."""

    def __init__(self, page, name, seed, folder: Path):
        self.page, self.dice = page, random.Random(f"{name} {seed}")
        self.file = folder / f"{name}.toml"
        self.done: list[str] = []
        self.faults: list[str] = []
        self.compared = 0
        page.on("console", lambda message: self.fault(f"console: {message.text}"))
        page.on("pageerror", lambda error: self.fault(f"{error}\n{error.stack}"))
        self.several = page.evaluate(
            "JSON.parse(document.getElementById('mechdae').textContent).drivers"
        )

    def fault(self, text):
        self.faults.append(f"{text}\n    after {'; '.join(self.done[-6:])}")

    def one(self, selector):
        """Return one of the elements that can be used, None without any."""
        all_ = [own for own in self.page.locator(selector).all() if own.is_visible()]
        return self.dice.choice(all_) if all_ else None

    # -- gestures

    def slide(self):
        if own := self.one("input[type=range]"):
            low, high = (float(own.get_attribute(key)) for key in ("min", "max"))
            share = self.dice.choice((0.0, 1.0, self.dice.random()))
            self.done.append(f"{own.get_attribute('aria-label')} at {share:.3f}")
            own.fill(repr(low + share * (high - low)))

    def typed(self):
        if own := self.one("input[type=text]"):
            text = self.dice.choice(TYPED)
            if self.dice.random() < 0.5 and re.fullmatch(r"-?[\d.]+", own.input_value()):
                text = f"{float(own.input_value()) * self.dice.choice(FACTORS):.6g}"
            self.done.append(f"{own.get_attribute('aria-label')} = {text!r}")
            own.fill(text)
            own.press(self.dice.choice(("Enter", "Tab")))

    def drag(self):
        box = self.page.locator("#diagram").bounding_box()
        held = self.one("#diagram [data-id^=point-]") if self.dice.random() < 0.7 else None
        at = held.bounding_box() if held else box
        share = (0.5, 0.5) if held else (self.dice.random(), self.dice.random())
        x, y = at["x"] + share[0] * at["width"], at["y"] + share[1] * at["height"]
        far = [self.dice.choice((2, 40, 400)) * self.dice.uniform(-1, 1) for _ in "xy"]
        self.done.append(f"drag {x:.0f},{y:.0f} by {far[0]:.0f},{far[1]:.0f}")
        self.page.mouse.move(x, y)
        self.page.mouse.down()
        self.page.mouse.move(x + far[0], y + far[1], steps=4)
        self.page.mouse.up()

    def click(self):
        if own := self.one("#diagram [data-id]"):
            box = own.bounding_box()
            self.done.append(f"click {own.get_attribute('data-id')}")
            middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
            self.page.mouse.click(*middle)

    def press(self):
        own = self.one("#side button, [role=tab], input[type=checkbox], #drive button")
        self.done.append(f"press {own.evaluate('(own) => own.parentNode.textContent')[:30]}")
        own.click()

    def select(self):
        if own := self.one("select"):
            k = self.dice.randrange(own.locator("option:not([hidden])").count())
            self.done.append(f"{own.get_attribute('aria-label')}: {k}")
            own.select_option(index=k)

    def key(self):
        self.page.focus("#diagram")
        key = self.dice.choice(KEYS)
        self.done.append(key)
        self.page.keyboard.press(key)

    def wheel(self):
        self.done.append("wheel")
        box = self.page.locator("#diagram").bounding_box()
        self.page.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 0.4 * box["height"])
        self.page.mouse.wheel(0, self.dice.choice((-3000, -200, 200, 3000)))

    def undo(self):
        """Change a dimension, undo that, and do it again."""
        if not self.page.locator("#dimensions .rows input[type=text]").count():
            return
        self.page.locator("#tab-dimensions").click()
        own = self.one("#dimensions .rows input[type=text]")
        self.typed()
        self.page.keyboard.press("Escape")
        before = self.settled()
        own.fill(f"{float(own.input_value()) * 1.02:.6g}")
        own.press("Enter")
        self.done.append(f"{own.get_attribute('aria-label')} larger, undone, done")
        after = self.settled()
        if after["toml"] == before["toml"]:
            return
        self.page.focus("#diagram")
        for keys, wanted in (("Control+z", before), ("Control+Shift+z", after)):
            self.page.keyboard.press(keys)
            found = self.settled()
            same = all(found["pose"][key] == wanted["pose"][key] for key in ("points", "bodies"))
            if found["toml"] != wanted["toml"] or not same:
                self.fault(f"{keys}: other numbers or another pose")

    # -- what must hold

    def settled(self):
        self.page.evaluate(SETTLED)
        return self.page.evaluate(STATE)

    def check(self, compare):
        state = self.settled()
        pose, status = state["pose"], state["status"]
        wrong = WRONG.search(state["texts"])
        around = wrong and state["texts"][max(wrong.start() - 40, 0) :][:90]
        wide = state["wide"] > 0 and "wider than the window"
        for text in (state["alert"], state["odd"], around, wide):
            if text:
                self.fault(str(text))
        if self.page.evaluate("mechdae.live") is not True:
            return
        known = {"ok": "certified", "limit": "limit position", "unassembled": "does not assemble"}
        wanted = known.get(pose["status"])
        if wanted and wanted not in status and not any(word in status for word in SAID):
            self.fault(f"{pose['status']}: {status}")
        if state["toml"] is None or pose["status"] != "ok":
            return
        self.file.write_text(state["toml"], encoding="utf-8")
        try:
            self.against_python(pose, md.load(self.file).mechanism, compare)
        except MechdaeError as error:
            self.fault(f"Python refuses what is shown: {error}")

    def against_python(self, pose, mechanism, compare):
        """Compare distances of points with the numbers of the file, places with all modes."""
        places = {name: np.array(own["position"]) for name, own in pose["points"].items()}
        numbers, axes = mechanism.values(), "xyz"[: mechanism.dimension]
        local = {
            name: np.array([numbers[f"{name}.{axis}"] for axis in axes]) for name in places
        }  # fmt: skip
        size = max((np.abs(place).max() for place in places.values()), default=1.0)
        for one, two in itertools.combinations(places, 2):
            if one.split(".")[0] == two.split(".")[0]:
                far, wanted = (np.linalg.norm(own[one] - own[two]) for own in (places, local))
                if abs(far - wanted) > CLOSE * size:
                    self.fault(f"{one}, {two}: {far} apart, {wanted} in the file")
        led = [own["name"] for own in self.several] if self.several else [*pose["driver"]][:1]
        if not compare:
            return
        drivers = tuple(md.Driver(name, at=(pose["driver"][name],)) for name in led)
        found = md.solve(mechanism, md.Modes(drivers=drivers))
        gaps = [np.abs(found.points[name].position - place).max(1) for name, place in places.items()
                if name in found.points]  # fmt: skip
        self.compared += 1
        if not np.min(np.max(gaps, axis=0), initial=np.inf) < CLOSE * size:
            self.fault(f"none of Python's {len(found)} modes at {pose['driver']}")

    def play(self, steps):
        kinds = (self.slide, self.typed, self.drag, self.click, self.press, self.select, self.key,
                 self.wheel, self.undo)  # fmt: skip
        for k in range(steps):
            self.dice.choices(kinds, (3, 4, 4, 3, 5, 2, 4, 1, 2))[0]()
            self.check(compare=k % 5 == 4)
        return self


def played(browser, file, name, seed, steps, folder):
    """Return random gestures on a page that was just opened."""
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    loaded(page, file)
    gestures = PageGestures(page, name, seed, folder).play(steps)
    page.close()
    return gestures


def main():
    from playwright.sync_api import sync_playwright

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("problems", nargs="*")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--steps", type=int, default=60)
    asked = parser.parse_args()
    with sync_playwright() as own, tempfile.TemporaryDirectory() as folder:
        browser = own.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        for name in asked.problems or names():
            try:
                file = md.page(name).save(Path(folder) / "page.html")
            except MechdaeError:
                continue
            found = played(browser, file, name, asked.seed, asked.steps, Path(folder))
            print(f"{name}: {found.compared} compared", *found.faults, sep="\n  ", flush=True)


if __name__ == "__main__":
    main()
