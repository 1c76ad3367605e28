"""Random gestures in the editor, and what must hold after each of them.

``python -m tests.shared.gestures --seeds 0 40 --steps 60`` prints what did not.
"""

from __future__ import annotations

import argparse
import random
import tempfile
from pathlib import Path

import numpy as np

import mechdae as md
from mechdae.errors import MechdaeError
from tests.shared.browser import ARGUMENTS, CHROMIUM, loaded
from tests.shared.drawing import at, drop
from tests.shared.paths import ROOT

TOOLS = ("select", "link", "point", "pivot", "slider", "slot", "bar", "cylinder", "gear", "belt",
         "rack", "cam", "spring", "force", "mirror", "weld", "driver", "delete", "measure",
         "find")  # fmt: skip
TYPED = ("12", "45,5", "-3", "0", "1e9", "1e-12", "x", "", "1/0", "NaN", "80", "a_b", "B1", "é",
         "ground", "200", "-0", "2*3", "O", "link1", "Infinity", "30")  # fmt: skip
ALERT = "[...document.querySelectorAll('p[role=alert]')].map((own) => own.textContent).join()"


class Gestures:
    """A page, a generator of gestures and the faults that were met.

    What was done is in `done`, so that a fault can be told.
    """

    def __init__(self, page, seed, folder: Path):
        self.page, self.dice, self.folder = page, random.Random(seed), folder
        self.done: list[str] = []
        self.faults: list[str] = []
        self.solved = 0
        page.on("console", lambda message: self.fault(f"console: {message.text}"))
        page.on("pageerror", lambda error: self.fault(f"{error}\n{error.stack}"))

    def fault(self, text):
        self.faults.append(f"{text}\n    after {'; '.join(self.done[-8:])}")

    def place(self):
        """Return where to press [mm]: at or beside a point, on a link, or anywhere."""
        dice, nodes = self.dice, self.page.evaluate("mechdae.state().nodes")
        kind = dice.random()
        if nodes and kind < 0.75:
            one = dice.choice(nodes)
            x, y = 1000 * one["x"], 1000 * one["y"]
            if kind < 0.5:
                return x + dice.uniform(-1, 1), y + dice.uniform(-1, 1)
            two, share = dice.choice(nodes), dice.random()
            return (x + share * (1000 * two["x"] - x), y + share * (1000 * two["y"] - y))
        return dice.uniform(-60, 260), dice.uniform(-60, 160)

    def press(self):
        place = self.place()
        self.done.append(f"click {place[0]:.1f},{place[1]:.1f}")
        if self.dice.random() < 0.1:
            self.page.keyboard.down("Shift")
        self.page.mouse.click(*self.on_sheet(place))
        self.page.keyboard.up("Shift")

    def on_sheet(self, place):
        box = self.page.locator("#diagram").bounding_box()
        x, y = at(self.page, *place)
        return (
            min(max(x, box["x"] + 2), box["x"] + box["width"] - 2),
            min(max(y, box["y"] + 2), box["y"] + box["height"] - 2),
        )

    def drag(self):
        begin, end = self.place(), self.place()
        self.done.append(f"drag {begin[0]:.1f},{begin[1]:.1f} to {end[0]:.1f},{end[1]:.1f}")
        self.page.mouse.move(*self.on_sheet(begin))
        self.page.mouse.down()
        self.page.mouse.move(*self.on_sheet(end), steps=self.dice.choice((1, 3)))
        if self.dice.random() < 0.1:
            self.page.keyboard.press(self.dice.choice(("Escape", "Control+z", "Delete")))
        self.page.mouse.up()

    def tool(self):
        buttons = self.page.locator("#tools [data-tool]")
        name = self.dice.choice(TOOLS)
        if name == "mirror" and self.dice.random() < 0.7:  # each doubles the drawing
            return
        button = self.page.locator(f"[data-tool={name}]")
        if buttons.count() and button.count() and button.first.is_visible():
            self.done.append(name)
            button.first.click()

    def key(self):
        name = self.dice.choice(("Escape", "Control+z", "Control+z", "Control+Shift+z", "Delete",
                                 "Control+d"))  # fmt: skip
        self.done.append(name)
        self.page.keyboard.press(name)

    def typed(self):
        fields = self.page.locator("#properties input[type=text], #drive input[type=text]")
        shown = [one for one in fields.all() if one.is_visible() and one.is_enabled()]
        if not shown:
            return
        one, text = self.dice.choice(shown), self.dice.choice(TYPED)
        self.done.append(f"{one.get_attribute('aria-label')} = {text!r}")
        one.fill(text)
        one.press("Enter")

    def button(self):
        shown = [one for one in self.page.locator(
            "#properties button, #properties input[type=checkbox], #tabs [role=tab], #drive button,"
            " #acts button, #find button, #found button, #acts input"
        ).all() if one.is_visible() and one.is_enabled()]  # fmt: skip
        one = self.dice.choice(shown)
        name = one.inner_text().split("\n")[0] or one.get_attribute("aria-label") or ""
        if "task" in name:  # saves a file
            return
        self.done.append(f"button {name}")
        one.click()

    def slide(self):
        if self.page.locator("#drive input[type=range]").is_enabled():
            self.done.append("slide")
            self.page.locator("#drive input[type=range]").fill(f"{self.dice.random():.3f}")

    def template(self):
        self.done.append("template")
        chosen = self.page.locator("#acts select")
        chosen.select_option(str(self.dice.randrange(chosen.locator("option").count() - 1)))

    def file(self):
        path = self.dice.choice(sorted((ROOT / "problems").glob("*.toml")))
        text = path.read_text(encoding="utf-8")
        if "dimension = 3" in text or ".csv" in text:
            return
        self.done.append(f"file {path.stem}")
        drop(self.page, text, path.name)

    def wheel(self):
        self.done.append("wheel")
        self.page.mouse.move(*self.on_sheet(self.place()))
        self.page.mouse.wheel(0, self.dice.choice((-300, 300)))

    def step(self):
        """One gesture; what must hold after it."""
        act = self.dice.choices(
            (self.press, self.drag, self.tool, self.key, self.typed, self.button, self.slide,
             self.template, self.file, self.wheel),
            (30, 12, 22, 7, 10, 7, 3, 1, 1.2, 1))[0]  # fmt: skip
        act()
        if alert := self.page.evaluate(ALERT):
            self.fault(f"alert: {alert}")
            return False
        return True

    def same_as_python(self):
        """Compare the drawing with what Python reads and solves."""
        text, live = self.page.evaluate("[mechdae.toml(), mechdae.live]")
        if "[bodies" not in text and "\nbodies" not in text:
            return
        file = self.folder / "drawn.toml"
        file.write_text(text, encoding="utf-8")
        try:
            problem = md.load(file)
        except MechdaeError as error:
            if "no chain of joints connects" in str(error):  # the editor says so, too
                return
            self.fault(f"refused: {error}\n{text}")
            return
        led = self.page.evaluate("mechdae.state().drivers")
        if not live or len(led) != 1:
            return
        values = self.page.evaluate("mechdae.values()")
        chosen = [values[len(values) // 5], values[len(values) // 2]]
        try:
            result = md.solve(
                problem.mechanism, md.Sweep(driver=md.Driver(led[0], at=tuple(chosen)))
            )
        except MechdaeError as error:
            self.fault(f"python does not solve: {error}\n{text}")
            return
        for k, value in enumerate(chosen):
            pose = self.page.evaluate(f"mechdae.set({value!r}) && mechdae.pose()")
            if result.status[k] != "ok" or not pose:
                self.fault(f"status {result.status[k]} at {value} of {led}\n{text}")
                return
            for name, place in pose["points"].items():
                if name not in result.points:  # of the ground
                    continue
                off = np.abs(result.points[name].position[k] - place).max()
                if not off < 1e-9 * max(np.abs(place).max(), 1):
                    self.fault(f"{name} differs by {off} at {value} of {led}\n{text}")
                    return
        self.solved += 1

    def undone(self):
        """Undo everything and do it again: each text comes back."""
        page, texts = self.page, []
        page.locator("[data-tool=select]").click()
        now = page.evaluate("mechdae.toml()")
        press = page.locator("#acts button")
        while True:
            texts.append(now)
            press.nth(0).click()
            before, now = now, page.evaluate("mechdae.toml()")
            if now == before:
                break
        for text in reversed(texts[:-1]):
            press.nth(1).click()
            if page.evaluate("mechdae.toml()") != text:
                self.fault("redo: another text")
                return

    def play(self, steps, every=5):
        """Make gestures; compare with Python after every few, and at the end undo all."""
        if begin := self.dice.choice((None, self.template, self.template, self.file)):
            begin()
        for k in range(steps):
            if not self.step():
                return
            if k % every == every - 1:
                self.same_as_python()
        self.undone()
        self.same_as_python()


def played(browser, file, seed, steps, folder):
    """Return the gestures of a seed in a new page."""
    page = browser.new_page(viewport={"width": 1000, "height": 900})
    page.set_default_timeout(30_000)
    gestures = Gestures(page, seed, folder)
    loaded(page, file)
    try:
        gestures.play(steps)
    except Exception as error:
        gestures.fault(f"{type(error).__name__}: {error}")
    page.close()
    return gestures


def main():
    """Play many seeds and print faults."""
    from playwright.sync_api import sync_playwright

    from mechdae.parts.page.editor import editor

    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, nargs=2, default=(0, 20))
    parser.add_argument("--steps", type=int, default=60)
    options = parser.parse_args()
    with sync_playwright() as own, tempfile.TemporaryDirectory() as folder:
        browser = own.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        file, solved, faults = editor().save(Path(folder) / "editor.html"), 0, 0
        for seed in range(*options.seeds):
            gestures = played(browser, file, seed, options.steps, Path(folder))
            solved, faults = solved + gestures.solved, faults + len(gestures.faults)
            for fault in gestures.faults[:2]:
                print(f"== seed {seed}: {fault}", flush=True)
        print(f"{solved} drawings solved by Python, {faults} faults")
        browser.close()


if __name__ == "__main__":
    main()
