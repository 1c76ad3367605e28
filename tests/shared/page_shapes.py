"""What a page draws in a browser beside what `plot` draws of the same pose."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np

import mechdae as md
from mechdae.draw import style
from mechdae.draw.diagram.diagram import View, draw_scene, extent
from mechdae.draw.diagram.scene import read_scene
from mechdae.draw.sheet import Sheet
from mechdae.draw.words import Words
from tests.shared.browser import until
from tests.shared.drawn import gids, with_gid

UNIT = 0.6
"""What a corner may be off [unit of the sheet]."""
HATCHED = 4.0
"""Strokes of hatching keep their number where the scale is another one."""
FREE = {style.ARROW: "arrow", style.LOAD: "load", style.FAINT: "faint"}
"""Arrows and springs take what room there is: their places in the page hold for all poses."""
SHAPES = """() => [...document.querySelectorAll("#diagram .parts > g")].flatMap((part) => {
  if (part.getAttribute("display") === "none") return [];
  const moved = part.transform.baseVal.consolidate();
  const m = moved ? moved.matrix : { a: 1, b: 0, c: 0, d: 1, e: 0, f: 0 };
  const at = ([x, y]) => [m.a * x + m.c * y + m.e, m.b * x + m.d * y + m.f];
  return [...part.children].map((shape) => {
    const number = (name) => Number(shape.getAttribute(name));
    const pairs = (shape.getAttribute("d") || "").matchAll(/(-?[\\d.]+) (-?[\\d.]+)/g);
    const points = shape.tagName === "path"
      ? [...pairs].map(([, x, y]) => at([Number(x), Number(y)]))
      : [at(["x", "y"].map((axis) => number(shape.tagName === "circle" ? `c${axis}` : axis)))];
    const paint = `${shape.getAttribute("stroke")} ${shape.getAttribute("fill")}`;
    return { id: part.dataset.id, points, paint, text: shape.textContent, radius: number("r") };
  });
})"""


class Pages(dict[str, Path]):
    """Pages by the names of problems, and what was solved for them, each made when it is asked for.

    ``cases`` are the tasks by problem, None for the page's own choice.
    """

    def __init__(self, folder, cases):
        super().__init__()
        self.folder, self.cases, self.solved = folder, dict(cases), {}

    def __missing__(self, name):
        page = md.page(name, self.cases[name])
        self.solved[name] = page, md.solve(name, page.data["task"])
        self[name] = page.save(self.folder / f"{name}.html")
        return self[name]


def placed(shapes, drawn):
    """Return a sheet that has the page's scale and place, from where its pins are."""
    pins = {
        shape.gid: drawn.back(shape.points)[0]
        for shape in drawn.drawn
        if shape.kind == "circle" and re.search("-(pin|follower)$|^point-", str(shape.gid))
    }
    rows = [(shape["points"][0], pins[shape["id"]]) for shape in shapes if shape["id"] in pins]
    seen = np.array([shape for shape, _ in rows])
    real = np.array([place for _, place in rows])
    up = seen * (1, -1)
    spread = real - real.mean(axis=0)
    metre = float(((up - up.mean(axis=0)) * spread).sum() / (spread**2).sum())
    shift = up.mean(axis=0) - metre * real.mean(axis=0)
    np.testing.assert_allclose(metre * real + shift, up, atol=0.02)
    sheet = Sheet(None, (0.0, 0.0), (1.0, 1.0), memory={})
    sheet.metre, sheet.corner = metre, -shift / metre
    return sheet


def apart(shape, wanted, points, radius):
    """Return how far a shape is from a primitive; of hatching, which has no name, a share of it."""
    if (shape.kind == "circle") != (radius > 0) or not len(points):
        return np.inf
    if shape.gid is None and len(wanted) > 6:
        middles = [(row.min(axis=0) + row.max(axis=0)) / 2 for row in (wanted, points)]
        return float(np.abs(middles[0] - middles[1]).max()) / HATCHED
    if shape.gid and shape.gid.startswith("bridge-") and len(points) == len(wanted):
        return float(np.abs(points[[0, -1]].mean(axis=0) - wanted[[0, -1]].mean(axis=0)).max())
    if len(points) - len(wanted) not in (0, 1):
        return np.inf
    return max(float(np.abs(points[: len(wanted)] - wanted).max()), abs(radius - shape.radius))


def compare_primitives(opened, pages, name):
    """Compare three poses of a page with `plot`; return how far the farthest primitive is off."""
    browser_page = opened(name)
    page, result = pages.solved[name]
    scene, several = read_scene(result), page.data.get("drivers")
    drivers = [own["name"] for own in several] if several else [page.data["driver"]["name"]]
    values = {name: np.asarray(result.drivers[name].position) for name in drivers}
    known = [k for k in scene.assembled() if result.status[k] == "ok"]
    worst = 0.0
    for pose in (known[len(known) // 7], known[len(known) // 2], known[-len(known) // 5]):
        at = {name: own[pose] for name, own in values.items()}
        if page.data["live"]:
            assert browser_page.evaluate(f"mechdae.set({json.dumps(at)})"), pose
        else:
            shown_recorded(browser_page, page, at)
        shapes = browser_page.evaluate(SHAPES)
        view = View(bounds=extent(scene, pose, True))
        first = Sheet(None, *view.bounds[:2])
        draw_scene(first, scene, result, pose, view, Words())
        sheet = placed(shapes, first)
        draw_scene(sheet, scene, result, pose, view, Words())
        drawn = [shape for shape in sheet.drawn if shape.color not in FREE]
        free = [f"var(--{name})" for name in FREE.values()]
        there = [shape for shape in shapes if not shape["id"].startswith(("label", "number"))]
        there = [shape for shape in there if not any(color in shape["paint"] for color in free)]
        assert len(there) == len(drawn)
        off = np.array(
            [
                [
                    apart(shape, shape.points * (1, -1), np.array(own["points"]), own["radius"])
                    for own in there
                ]
                for shape in drawn
            ]
        )
        of = matched(off <= UNIT)
        for k, shape in enumerate(drawn):
            place = (pose, shape.kind, shape.gid, shape.points.tolist(), off[k].min())
            assert k in of.values(), place
        worst = max(worst, *(float(off[k, j]) for j, k in of.items()))
    return worst


def shown_recorded(browser_page, page, at):
    """Show the recorded pose with a value of the driver, which has to be there."""
    ((name, value),) = at.items()
    rows = np.abs(np.array(page.data["driver"]["values"]) - value)
    k, last = int(rows.argmin()), len(rows) - 1
    assert rows[k] == 0.0
    browser_page.locator("#drive input[type=range]").evaluate(
        "(own, share) => { own.value = share; own.dispatchEvent(new Event('input')); }", k / last
    )
    until(browser_page, f"Math.abs(mechdae.pose().driver['{name}'] - {value}) < 1e-9")


def matched(near):
    """Return which row is given to which column of a table of what suits, as many as can be."""
    of: dict[int, int] = {}

    def given(k, seen):
        for j in np.flatnonzero(near[k]).tolist():
            if j not in seen:
                seen.add(j)
                if j not in of or given(of[j], seen):
                    of[j] = k
                    return True
        return False

    for k in range(len(near)):
        given(k, set())
    return of


def compare_names(opened, pages, name):
    """Compare the letters and numbers of a page with those of `plot`."""
    page = opened(name)
    result = pages.solved[name][1]
    ax = md.plot(result, "diagram")
    kinds = ("label-", "detail-label-")  # of pins in an enlarged detail there
    labels = [label for label in gids(ax) if label.startswith(kinds) and "load" not in label]
    wanted = sorted(with_gid(ax, gid)[-1].get_text() for gid in dict.fromkeys(labels))
    shapes = page.evaluate(SHAPES)
    texts = {}
    for shape in shapes:
        if shape["id"].startswith("label-") and "load" not in shape["id"]:
            texts.setdefault(shape["id"], shape["text"])
    assert sorted(texts.values()) == wanted
    numbers = {shape["id"] for shape in shapes if shape["id"].startswith("number-")}
    assert numbers == {f"number-{body}" for body in result.mechanism.bodies}
