"""Live pages and the editor in Firefox and WebKit: what they show against what Python solved.

    python -m tests.scripts.browsers --out docs/data/browsers.json [--only Firefox] [NAME ...]

Firefox is spoken to over its own port (WebDriver BiDi); in it mechanisms are drawn by mouse events
too. WebKitGTK is led by ``WebKitWebDriver`` and selenium under ``Xvfb``. Debian: ``firefox-esr``,
``webkit2gtk-driver``, ``xvfb``; ``pip install selenium``. Not in CI; run before a release.
"""

from __future__ import annotations

import argparse
import base64
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

import mechdae as md
from mechdae.describe.file.library import names
from mechdae.errors import MechdaeError
from mechdae.parts.page.editor import editor
from tests.shared import drawing
from tests.shared.firefox import Firefox

ASKED = """(() => {
  const data = JSON.parse(document.getElementById('mechdae').textContent);
  const { live } = mechdae;
  const poses = data.driver.values.map((value) => {
    if (live === true) mechdae.set({ [data.driver.name]: value });
    const pose = mechdae.pose();
    const points = Object.entries(pose.points).map(([name, own]) => [name, own.position]);
    return [pose.status, Object.fromEntries(points)];
  });
  const shown = document.querySelectorAll('#diagram path, #diagram line').length;
  return JSON.stringify({ live, poses: live === true ? poses : [], shown });
})()"""
DRAWN = """(() => {
  const all = mechdae.values(), values = all.filter((_, k) => k % 30 === 2);
  const poses = values.map((value) => [mechdae.set(value), mechdae.pose().points]);
  const shown = document.querySelectorAll('#diagram path, #diagram line').length;
  const mobility = mechdae.mobility(), [led] = mechdae.state().drivers;
  return JSON.stringify({ values, poses, shown, mobility, led, toml: mechdae.toml() });
})()"""
EDITED = ("gorshkov-seven-link", "triad-six-modes", "c1-exact-max-mu")
"""Problems that the editor opens."""
GESTURES = {
    "four-bar with coupler point": drawing.COUPLER,
    "slider-crank at 30 degrees": drawing.SLIDER_CRANK,
    "Watt six-bar": drawing.WATT,
    "geared five-bar": drawing.GEARED,
    "excavator arm with cylinders": drawing.EXCAVATOR,
    "toggle press with load": drawing.TOGGLE,
}
"""What is drawn by mouse events."""
SPENT = """(() => {
  const { sliders } = JSON.parse(document.getElementById('mechdae').textContent);
  if (!sliders || !sliders.length) return 'null';
  const { name, value } = sliders[0];
  const spent = [];
  for (let k = 0; k < 7; k += 1) {
    const at = performance.now();
    mechdae.set({ [name]: value * (1 + 0.002 * (k % 3)) });
    spent.push(performance.now() - at);
  }
  mechdae.set({ [name]: value });
  return JSON.stringify(spent.sort((a, b) => a - b)[3]);
})()"""


class WebKit:
    """WebKitGTK's MiniBrowser on a display of its own, by its WebDriver."""

    def __init__(self, folder: Path) -> None:
        from selenium import webdriver
        from selenium.webdriver.webkitgtk.service import Service

        number = 70 + os.getpid() % 20
        self.display = subprocess.Popen(
            ["Xvfb", f":{number}", "-screen", "0", "1280x1024x24"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        time.sleep(2)
        env = {**os.environ, "DISPLAY": f":{number}", "HOME": str(folder)}
        env |= {"WEBKIT_DISABLE_SANDBOX_THIS_IS_DANGEROUS": "1", "LIBGL_ALWAYS_SOFTWARE": "1"}
        options = webdriver.WebKitGTKOptions()
        found = sorted(Path("/usr/lib").glob("*/webkit2gtk-*/MiniBrowser"))
        options.binary_location = str(found[-1])
        options.add_argument("--automation")
        service = Service(shutil.which("WebKitWebDriver"), env=env)
        self.driver = webdriver.WebKitGTK(options=options, service=service)
        self.driver.set_script_timeout(120)
        self.version = f"WebKitGTK {self.driver.capabilities['browserVersion']}"
        self.said: list[str] = []  # its driver tells nothing of the console

    def opens(self, file: Path) -> None:
        """Open a page."""
        self.driver.get(f"file://{file}")
        self.driver.execute_script("return mechdae.ready.then(() => true);")

    def asks(self, expression: str) -> Any:
        """Return the value of an expression that gives JSON."""
        return json.loads(self.driver.execute_script(f"return {expression};"))

    def close(self) -> None:
        """End it."""
        self.driver.quit()
        self.display.terminate()
        self.display.wait(30)


def compared(page: md.Page, found: dict[str, Any]) -> dict[str, Any]:
    """Return how far the poses shown are from Python's, as a share of the largest coordinate."""
    data = page.data
    places = {
        name: np.frombuffer(base64.b64decode(text), "<f8").reshape(-1, data["scene"]["dimension"])
        for name, text in data["recorded"]["points"].items()
    }
    size = max(np.nanmax(np.abs(own)) for own in places.values() if np.isfinite(own).any())
    worst, statuses = 0.0, 0
    for k, (status, points) in enumerate(found["poses"]):
        python = data["status"][k]
        statuses += status != python and {status, python} <= {"ok", "limit", "unassembled"}
        if status != "ok" or python != "ok":
            continue
        for name, own in places.items():
            if name in points:
                worst = max(worst, float(np.abs(np.array(points[name]) - own[k]).max() / size))
    return {"poses": len(found["poses"]), "worst": float(f"{worst:.2g}"), "statuses": statuses}


def edited(browser: Firefox | WebKit, folder: Path) -> dict[str, Any]:
    """Return how far the editor's preview is from what Python solves of the file it saves."""
    worst, poses, empty = 0.0, 0, []
    for name in EDITED:
        browser.opens(editor(name).save(folder / "editor.html"))
        found = browser.asks(DRAWN)
        if not found["shown"] or found["mobility"] != {"count": 1, "rank": 1, "without": []}:
            empty.append(name)
        file = folder / "drawn.toml"
        file.write_text(found["toml"], encoding="utf-8")
        saved = md.load(file)
        if not found["values"]:
            continue
        driver = md.Driver(found["led"], at=tuple(found["values"]))
        result = md.solve(saved.mechanism, md.Sweep(driver=driver))
        size = max(np.abs(own.position).max() for own in result.points.values())
        for k, (closes, points) in enumerate(found["poses"]):
            poses += bool(closes)
            for point, place in points.items():
                if closes and point in result.points:
                    off = np.abs(np.array(place) - result.points[point].position[k]).max()
                    worst = max(worst, float(off / size))
    return {"poses": poses, "worst": float(f"{worst:.2g}"), "empty": empty}


def gestured(browser: Firefox, folder: Path) -> dict[str, Any]:
    """Return what drawing by mouse events took, and how far it is from what Python solves of it."""
    table = {}
    for name, steps in GESTURES.items():
        browser.opens(editor().save(folder / "editor.html"))
        if steps is not drawing.EXCAVATOR:
            drawing.out(browser, 1.6)
        begun = time.monotonic()
        clicks = drawing.draw(browser, steps)
        seconds = round(time.monotonic() - begun, 1)
        poses, worst = drawing.as_python(browser, folder / "drawn.toml")
        table[name] = {"clicks": clicks, "seconds": seconds, "poses": poses,
                       "worst": float(f"{worst:.2g}")}  # fmt: skip
    return table


def examined(kind: type[Firefox] | type[WebKit], chosen: list[str]) -> dict[str, Any]:
    """Return the figures of one browser, page by page."""
    table: dict[str, Any] = {}
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        browser = kind(Path(folder))
        try:
            for name in chosen:
                try:
                    page = md.page(name)
                except MechdaeError:
                    continue
                browser.said.clear()
                browser.opens(page.save(Path(folder) / f"{name}.html"))
                found = browser.asks(ASKED)
                own = {"live": found["live"] is True, "said": list(browser.said)}
                own["as_python"] = own["live"] == bool(page.data["live"])
                if own["live"]:
                    own |= compared(page, found)
                    own["change_ms"] = browser.asks(SPENT)
                own["drawn"] = found["shown"] > 0
                table[name] = own
                print(browser.version, name, own, file=sys.stderr, flush=True)
            browser.said.clear()
            drawn = edited(browser, Path(folder))
            if isinstance(browser, Firefox):
                drawn["drawn"] = gestured(browser, Path(folder))
            drawn["said"] = list(browser.said)
        finally:
            browser.close()
    return summed(browser.version, table, drawn)


def summed(version: str, table: dict[str, Any], drawn: dict[str, Any]) -> dict[str, Any]:
    """Return the figures of all pages of a browser, beside those of its editor."""
    live = [own for own in table.values() if own["live"]]
    changed = sorted(own["change_ms"] for own in live if own["change_ms"] is not None)
    return {
        "browser": version,
        "pages": len(table),
        "live": len(live),
        "poses": sum(own["poses"] for own in live),
        "worst": max(own["worst"] for own in live),
        "other_statuses": sum(own["statuses"] for own in live),
        "median_change_ms": round(changed[len(changed) // 2], 1),
        "not_as_python": [name for name, own in table.items() if not own["as_python"]],
        "empty": [name for name, own in table.items() if not own["drawn"]],
        "said": {name: own["said"] for name, own in table.items() if own["said"]},
        "editor": drawn,
    }


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("names", nargs="*")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--only", choices=("Firefox", "WebKit"))
    options = parser.parse_args()
    known = options.out and options.out.exists() and options.only
    figures = json.loads(options.out.read_text(encoding="utf-8")) if known else []
    for kind in (Firefox, WebKit):
        if options.only not in (None, kind.__name__):
            continue
        figures = [own for own in figures if not own["browser"].startswith(kind.__name__)]
        figures.append(examined(kind, options.names or list(names())))
        if options.out:
            options.out.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(figures, indent=1))


if __name__ == "__main__":
    main()
