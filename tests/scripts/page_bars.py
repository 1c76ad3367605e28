"""Live pages and the editor in a real browser: size, times, frames, letters, phones, axe-core.

    python -m tests.scripts.page_bars [--out FILE] [--axe FOLDER] [--pictures FOLDER] [NAME ...]
    python -m tests.scripts.page_bars --out FILE --part letters|frames [NAME ...]  # these anew
    python -m tests.scripts.page_bars --out FILE --only-axe --axe FOLDER  # in light, dark

``--axe`` is a folder with ``axe.min.js`` (``npm pack axe-core``); it is not part of the package.
With ``--pictures`` each page is photographed: light, dark, phone, Russian. Rows of pages that are
not named stay in FILE.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

import mechdae as md
from mechdae.describe.file.library import names
from mechdae.errors import MechdaeError
from mechdae.parts.page.editor import editor
from tests.shared.browser import ARGUMENTS, CHROMIUM, loaded

DRAG = """async (seconds) => {
  const ranges = document.querySelectorAll('#dimensions .rows input[type=range]');
  const range = ranges[0] || document.querySelector('input[type=range]'); // which drives
  const middle = Number(range.value), begun = performance.now();
  let frames = 0;
  while (performance.now() - begun < 1000 * seconds) {
    await new Promise((done) => requestAnimationFrame(done));
    frames += 1;
    range.value = String(middle * (1 + 0.05 * Math.sin(frames / 9)));
    range.dispatchEvent(new Event('input', { bubbles: true }));
  }
  const per = (1000 * frames) / (performance.now() - begun);
  range.value = String(middle);
  range.dispatchEvent(new Event('input', { bubbles: true }));
  return per;
}"""
CHANGE = """() => {
  const name = JSON.parse(document.getElementById('mechdae').textContent).sliders[0];
  if (!name) return null;
  const spent = [];
  for (let k = 0; k < 11; k += 1) {
    const at = performance.now();
    mechdae.set({ [name.name]: name.value * (1 + 0.002 * (k % 5)) });
    spent.push(performance.now() - at);
  }
  mechdae.set({ [name.name]: name.value });
  return spent.sort((a, b) => a - b)[5];
}"""
READY = "() => performance.getEntriesByType('navigation')[0].domInteractive"
# boxes of the letters' ink against the edges of links and against other letters, at poses in turn
LETTERS = """async (count) => {
  const slider = document.querySelector('#drive input[type=range]');
  const cuts = (box, path) => {
    const length = path.getTotalLength();
    for (let at = 0; at <= length; at += 2) {
      const { x, y } = path.getPointAtLength(at);
      if (x > box[0] && x < box[1] && y > box[2] && y < box[3]) return true;
    }
    return false;
  };
  let covered = 0;
  for (let k = 0; k < count; k += 1) {
    slider.value = String((k + 0.5) / count);
    slider.dispatchEvent(new Event('input', { bubbles: true }));
    await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
    const labels = '#diagram .parts [data-id^=label-]';
    const boxes = [...document.querySelectorAll(labels)].flatMap((own) => {
      const { x, y, width, height } = own.getBBox(), { e, f } = own.transform.baseVal[0].matrix;
      const shown = own.getAttribute('display') !== 'none';
      return shown ? [[x + e, x + e + width, f + y + height / 2 - 5, f + y + height / 2 + 5]] : [];
    });
    if (!boxes.length) return null;
    const plane = [...document.querySelectorAll('#diagram .parts [data-id^=body-] path')];
    const space = [...document.querySelectorAll('#diagram .depths path[data-id^=body-]')];
    const links = [...plane, ...space].filter((own) => !own.hasAttribute('transform'));
    const bad = boxes.some((a, i) => boxes.some((b, j) => j > i && a[0] < b[1] && b[0] < a[1]
      && a[2] < b[3] && b[2] < a[3]) || links.some((link) => cuts(a, link)));
    covered += bad ? 1 : 0;
  }
  return covered / count;
}"""
SMALL = """() => [...document.querySelectorAll('button, select, input, a')].filter((own) => {
  const area = (own.type === 'checkbox' ? own.closest('label') : own).getBoundingClientRect();
  return area.width > 0 && (area.height < 24 || area.width < 24);
}).map((own) => own.getAttribute('aria-label') || own.textContent || own.type)"""
WIDE = "() => document.documentElement.scrollWidth - document.documentElement.clientWidth"
COUNT = """(seconds) => new Promise((done) => {
  const begun = performance.now();
  let frames = 0;
  const next = (now) => {
    if (now - begun >= 1000 * seconds) { done(frames); return; }
    frames += 1;
    requestAnimationFrame(next);
  };
  requestAnimationFrame(next);
})"""
FRAMES = 48
MIDDLE_AND_MOST = (statistics.median, max)
SMALL_LINKS = 8
"""Links with the ground up to which 60 frames a second are aimed at."""


class Visit:
    """One page in one language, opened in a browser."""

    def __init__(self, browser: Any, file: Path, lang: str, axe: str | None, pictures: Path | None):
        self.said: list[str] = []
        self.file, self.lang, self.axe, self.pictures = file, lang, axe, pictures
        self.violations: dict[str, list[str]] = {}
        page = browser.new_page(viewport={"width": 1280, "height": 800}, color_scheme="light")
        page.on("console", lambda message: self.said.append(message.text))
        page.on("pageerror", lambda error: self.said.append(str(error)))
        page.on("request", lambda asked: self.said.append(asked.url)
                if not asked.url.startswith(("file:", "blob:", "data:")) else None)  # fmt: skip
        loaded(page, file)
        self.page = page

    def look(self, kind: str) -> None:
        """Take a picture, and ask axe-core."""
        if self.pictures is not None:
            name = f"{self.file.stem}.{self.lang}.{kind}.png"
            self.page.screenshot(path=self.pictures / name, full_page="phone" in kind)
        if self.axe:
            self.page.evaluate(self.axe)
            asked = "axe.run().then((r) => r.violations.map((v) => v.id))"
            found = self.page.evaluate(asked)
            for tab in self.page.locator("[role=tab]").all():
                tab.click()
                found += self.page.evaluate(asked)
            self.violations[f"{self.lang} {kind}"] = found

    def measure(self) -> dict[str, Any]:
        """Return times, frames and letters."""
        page = self.page
        found: dict[str, Any] = {
            "live": page.evaluate("mechdae.live") is True,
            "interactive_ms": round(page.evaluate(READY)),
        }
        if not found["live"]:
            return found
        change = page.evaluate(CHANGE)
        found["change_ms"] = None if change is None else round(change, 1)
        found["frames"] = round(page.evaluate(DRAG, 1.2), 1)
        page.wait_for_timeout(200)
        found |= self.played(2.0)
        found["letters"] = page.evaluate(LETTERS, FRAMES)
        return found

    def played(self, seconds: float) -> dict[str, float]:
        """Return frames a second of Play, and processor time of the main thread in each."""
        page, session = self.page, self.page.context.new_cdp_session(self.page)
        session.send("Performance.enable", {"timeDomain": "threadTicks"})

        def spent() -> dict[str, float]:
            found = session.send("Performance.getMetrics")["metrics"]
            return {entry["name"]: 1000 * entry["value"] for entry in found}

        play = page.locator("#drive button").first
        play.click()
        page.wait_for_timeout(500)
        before, count, after = spent(), page.evaluate(COUNT, seconds), spent()
        play.click()
        session.detach()
        kinds = {"frame_ms": "TaskDuration", "script_ms": "ScriptDuration"}
        each = {key: (after[name] - before[name]) / count for key, name in kinds.items()}
        return {key: round(value, 2) for key, value in each.items()} | {"played": count / seconds}

    def shapes(self) -> dict[str, Any]:
        """Look at it in the dark and on phones; return what is too wide or too small there."""
        page, found = self.page, {}
        page.emulate_media(color_scheme="dark")
        self.look("dark")
        page.emulate_media(color_scheme="light")
        for width in (320, 390):
            page.set_viewport_size({"width": width, "height": 844})
            page.wait_for_timeout(60)
            found[f"too_wide_{width}"] = page.evaluate(WIDE)
        tabs = page.locator("[role=tab]").all()
        found["small"] = [text for tab in tabs for text in (tab.click(), page.evaluate(SMALL))[1]]
        self.look("phone")
        page.close()
        return found


def measured(
    browser: Any, name: str, folder: Path, axe: str | None, pictures: Path | None
) -> dict[str, Any]:
    """Return what is measured of one page."""
    made = md.page(name)
    file = made.save(folder / f"{name}.html")
    visit = Visit(browser, file, "en", axe, pictures)
    links = 1 + len(made.data["scene"]["bodies"])
    found = {"bytes": file.stat().st_size, "links": links, **visit.measure()}
    visit.look("light")
    found |= visit.shapes()
    russian = Visit(browser, md.page(name, lang="ru").save(file), "ru", axe, pictures)
    russian.look("light")
    for key, value in russian.shapes().items():
        found[key] = found[key] or value
    found["said"] = visit.said + russian.said
    if axe:
        own = visit.violations | russian.violations
        found["axe"] = {kind: ids for kind, ids in own.items() if ids}
    return found


def anew(
    browser: Any, name: str, folder: Path, before: dict[str, Any], part: str
) -> dict[str, Any]:
    """Return the row of a page with its size and a part measured again: letters or frames."""
    file = md.page(name).save(folder / f"{name}.html")
    visit = Visit(browser, file, "en", None, None)
    found = before | {"bytes": file.stat().st_size}
    if before["live"]:
        visit.page.wait_for_timeout(500)
        found |= (
            {"letters": visit.page.evaluate(LETTERS, FRAMES)}
            if part == "letters"
            else visit.played(2.0)
        )
    visit.page.close()
    return found | {"said": before["said"] + visit.said}


def axed(browser: Any, name: str, folder: Path, axe: str, before: dict[str, Any]) -> dict[str, Any]:
    """Return the row of a page with what axe-core and the console say, in light and dark."""
    file = md.page(name).save(folder / f"{name}.html")
    visit = Visit(browser, file, "en", axe, None)
    for kind in ("light", "dark"):
        visit.page.emulate_media(color_scheme=kind)
        visit.look(kind)
    visit.page.close()
    found = before.get("axe", {}) | visit.violations
    found = {kind: ids for kind, ids in found.items() if ids}
    return before | {"axe": found, "said": before["said"] + visit.said}


def edited(browser: Any, folder: Path, axe: str | None, pictures: Path | None) -> dict[str, Any]:
    """Return what axe-core and phones find in the editor, empty and with a mechanism."""
    found: dict[str, Any] = {"axe": {}, "said": [], "small": [], "bytes": 0}
    for name, lang in ((None, "en"), ("gorshkov-seven-link", "en"), ("c1-exact-max-mu", "ru")):
        file = editor(name, lang).save(folder / f"editor-{name or 'empty'}.html")
        visit = Visit(browser, file, lang, axe, pictures)
        visit.look("light")
        for key, value in visit.shapes().items():
            found[key] = found.get(key) or value
        found["said"] += visit.said
        found["axe"] |= {f"{name} {kind}": ids for kind, ids in visit.violations.items() if ids}
        found["bytes"] = max(found["bytes"], file.stat().st_size)
    return found


def summed(table: dict[str, Any], version: str) -> dict[str, Any]:
    """Return the figures of all pages."""
    live = [entry for entry in table.values() if entry.get("live")]
    small = [entry for entry in live if entry.get("links", SMALL_LINKS + 1) <= SMALL_LINKS]
    changed = [entry["change_ms"] for entry in live if entry["change_ms"] is not None]
    return {
        "version": md.__version__,
        "date": time.strftime("%Y-%m-%d"),
        "browser": version,
        "load": round(os.getloadavg()[2], 1),
        "pages": len(table),
        "live": len(live),
        "largest_bytes": max(entry["bytes"] for entry in table.values()),
        "median_bytes": statistics.median(entry["bytes"] for entry in live),
        "median_interactive_ms": statistics.median(entry["interactive_ms"] for entry in live),
        "median_change_ms": statistics.median(changed),
        "median_frames": statistics.median(entry["frames"] for entry in live),
        "small": len(small),
        "small_frame_ms": [round(of([p["frame_ms"] for p in small]), 1) for of in MIDDLE_AND_MOST],
        "small_played": statistics.median(entry["played"] for entry in small),
        "letters": round(statistics.mean(entry.get("letters") or 0.0 for entry in live), 4),
        "said": sum(len(entry["said"]) for entry in table.values()),
        "too_wide": [
            n for n, entry in table.items() if entry["too_wide_320"] or entry["too_wide_390"]
        ],
        "too_small": sorted({text for entry in table.values() for text in entry["small"]}),
        "axed": sum("axe" in entry for entry in table.values()),
        "axe": sum(len(ids) for entry in table.values() for ids in entry.get("axe", {}).values()),
    }


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("names", nargs="*")
    parser.add_argument("--out")
    parser.add_argument("--axe")
    parser.add_argument("--pictures", type=Path)
    parser.add_argument("--part", choices=("letters", "frames"))
    parser.add_argument("--only-axe", action="store_true")
    options = parser.parse_args()
    from playwright.sync_api import sync_playwright

    axe = Path(options.axe, "axe.min.js").read_text(encoding="utf-8") if options.axe else None
    table, drawn = dict[str, Any](), dict[str, Any]()
    again = options.part or options.only_axe
    if (options.names or again) and options.out and Path(options.out).exists():
        known = json.loads(Path(options.out).read_text(encoding="utf-8"))
        table, drawn = known["pages"], known["editor"]
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as own:
        browser = own.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        for name in options.names or (list(table) if again else names()):
            if options.only_axe:
                table[name] = axed(browser, name, Path(folder), axe or "", table[name])
                print(name, table[name]["axe"], table[name]["said"], flush=True)
                continue
            if options.part:
                table[name] = anew(browser, name, Path(folder), table[name], options.part)
                print(name, table[name].get("letters"), table[name].get("played"), flush=True)
                continue
            try:
                table[name] = measured(browser, name, Path(folder), axe, options.pictures)
            except MechdaeError as error:
                print(name, "-", str(error).splitlines()[0])
                continue
            print(name, table[name], flush=True)
        drawn = drawn if again else edited(browser, Path(folder), axe, options.pictures)
        print("editor", drawn, flush=True)
        version = browser.version
        browser.close()
    table = {name: table[name] for name in names() if name in table}
    summary = summed(table, version) if table else {"browser": version}
    print(json.dumps(summary, indent=1))
    if options.out:
        text = json.dumps({"summary": summary, "editor": drawn, "pages": table}, indent=1)
        Path(options.out).write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
