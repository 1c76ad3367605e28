"""Live pages in a real browser: size, time to interactive, frames while dragging, axe-core.

    python -m tests.scripts.page_bars [--out FILE] [--axe FOLDER] [--firefox] [NAME ...]

``--axe`` is a folder with ``axe.min.js`` (``npm pack axe-core``); it is not part of the package.
``--firefox`` opens the pages in Firefox by playwright, where that is installed.
"""

from __future__ import annotations

import argparse
import json
import statistics
import tempfile
from pathlib import Path
from typing import Any

import mechdae as md
from mechdae.describe.file.library import names
from mechdae.errors import MechdaeError
from tests.shared.browser import ARGUMENTS, CHROMIUM

DRAG = """async (seconds) => {
  const ranges = document.querySelectorAll('input[type=range]');
  const range = ranges[1] || ranges[0]; // the first one drives
  const middle = Number(range.value), begun = performance.now();
  let frames = 0;
  while (performance.now() - begun < 1000 * seconds) {
    await new Promise((done) => requestAnimationFrame(done));
    frames += 1;
    range.value = String(middle * (1 + 0.05 * Math.sin(frames / 9)));
    range.dispatchEvent(new Event('input', { bubbles: true }));
  }
  return (1000 * frames) / (performance.now() - begun);
}"""
CHANGE = """() => {
  const name = JSON.parse(document.getElementById('mechdae').textContent).sliders[0];
  if (!name) return null;
  const spent = [];
  for (let k = 0; k < 15; k += 1) {
    const at = performance.now();
    mechdae.set({ [name.name]: name.value * (1 + 0.002 * (k % 5)) });
    spent.push(performance.now() - at);
  }
  mechdae.set({ [name.name]: name.value });
  return spent.sort((a, b) => a - b)[7];
}"""
READY = "() => performance.getEntriesByType('navigation')[0].domInteractive"


def measured(browser: Any, file: Path, axe: str | None) -> dict[str, Any]:
    """Return what is measured of one page."""
    said: list[str] = []
    found: dict[str, Any] = {"bytes": file.stat().st_size}
    violations: dict[str, list[str]] = {}
    for scheme in ("light", "dark") if axe else ("light",):
        page = browser.new_page(viewport={"width": 1200, "height": 900}, color_scheme=scheme)
        page.on("console", lambda message: said.append(message.text))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.on("request", lambda asked: said.append(asked.url)
                if not asked.url.startswith(("file:", "blob:", "data:")) else None)  # fmt: skip
        page.goto(f"file://{file}")
        if scheme == "light":
            found["live"] = page.evaluate("mechdae.live") is True
            found["interactive_ms"] = round(page.evaluate(READY))
            if found["live"]:
                change = page.evaluate(CHANGE)
                found["change_ms"] = None if change is None else round(change, 1)
                found["frames"] = round(page.evaluate(DRAG, 1.5), 1)
        if axe:
            page.evaluate(axe)
            results = page.evaluate("axe.run().then((r) => r.violations.map((v) => v.id))")
            violations[scheme] = results
        page.close()
    return found | {"said": said} | ({"axe": violations} if axe else {})


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("names", nargs="*")
    parser.add_argument("--out")
    parser.add_argument("--axe")
    parser.add_argument("--firefox", action="store_true")
    options = parser.parse_args()
    from playwright.sync_api import sync_playwright

    axe = Path(options.axe, "axe.min.js").read_text(encoding="utf-8") if options.axe else None
    table: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as own:
        kind = own.firefox if options.firefox else own.chromium
        known = {} if options.firefox else {"executable_path": CHROMIUM, "args": ARGUMENTS}
        browser = kind.launch(**known)
        for name in options.names or names():
            try:
                made = md.page(name)
            except MechdaeError as error:
                print(name, "-", str(error).splitlines()[0])
                continue
            table[name] = measured(browser, made.save(Path(folder) / f"{name}.html"), axe)
            print(name, table[name], flush=True)
        version = browser.version
        browser.close()
    live = [own for own in table.values() if own.get("live")]
    summary = {
        "browser": version,
        "pages": len(table),
        "live": len(live),
        "largest_bytes": max(own["bytes"] for own in live),
        "median_bytes": statistics.median(own["bytes"] for own in live),
        "median_interactive_ms": statistics.median(own["interactive_ms"] for own in live),
        "median_change_ms": statistics.median(
            own["change_ms"] for own in live if own["change_ms"] is not None
        ),
        "median_frames": statistics.median(own["frames"] for own in live),
        "said": sum(len(own["said"]) for own in table.values()),
    }
    print(json.dumps(summary, indent=1))
    if options.out:
        text = json.dumps({"summary": summary, "pages": table}, indent=1)
        Path(options.out).write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
