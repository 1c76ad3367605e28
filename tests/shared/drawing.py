"""Drawing in the editor by pointer events, and what is drawn in several tests."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from tests.shared.browser import until

FOUR_BAR = [("link", [(0, 0), (20, 40), (120, 80), (100, 0)]), ("pivot", [(0, 0), (100, 0)]),
            ("driver", [(10, 20)])]  # fmt: skip
# crank O A, its pin in the slot of rod G B; B C with a slider at C, B E and E F
SEVEN_LINK = [("link", [(0, 40), (50, 55)]), ("link", [(0, -40), (90, 130)]),
              ("slot", [(50, 55), (20, -2)]), ("link", [(90, 130), (190, 20)]),
              ("link", [(90, 130), (230, 120), (245, 20)]),
              ("pivot", [(0, 40), (0, -40), (245, 20)]), ("slider", [(190, 20)]),
              ("driver", [(25, 47)])]  # fmt: skip
# crank O C, platform D E F on three legs A D, B E, C F
TRIAD = [("link", [(-30, 100), (0, 110)]), ("link", [(100, 60), (200, 90)]),
         ("link", [(150, 75), (0, 110)]),
         ("link", [(100, 60), (60, -40)]), ("link", [(200, 90), (240, -30)]),
         ("pivot", [(-30, 100), (60, -40), (240, -30)]), ("driver", [(-15, 105)])]  # fmt: skip
# crank O A, coupler A B welded to a second link B C, a bar from C to the ground
WELDED = [("link", [(0, 0), (20, 40)]), ("link", [(20, 40), (120, 80)]),
          ("link", [(120, 80), (150, 120)]), ("weld", [(120, 80)]),
          ("bar", [(150, 120), (100, -5)]), ("pivot", [(0, 0)]),
          ("driver", [(10, 20)])]  # fmt: skip
SLIDER_CRANK = [("link", [(0, 0), (20, 40), (140, 80)]), ("pivot", [(0, 0)]),
                ("slider", [(140, 80, 240, 140)]), ("driver", [(10, 20)])]  # fmt: skip
WATT = [("link", [(0, 0), (20, 40), (110, 70), (100, 0)]), ("point", [(135, 50)]),
        ("link", [(135, 50), (230, 60), (220, 0)]), ("pivot", [(0, 0), (100, 0), (220, 0)]),
        ("driver", [(10, 20)])]  # fmt: skip
# two cranks on the ground, geared to each other, and two couplers between them
GEARED = [("link", [(0, 0), (-20, 40), (40, 110), (120, 50), (100, 0)]),
          ("pivot", [(0, 0), (100, 0)]), ("gear", [(0, 0), (100, 0)]),
          ("driver", [(-10, 20)])]  # fmt: skip
RACK = [("link", [(0, 0), (30, 40)]), ("pivot", [(0, 0), (60, -30)]),
        ("slider", [(60, -30, 100, -30)]), ("rack", [(0, 0), (60, -30)]),
        ("driver", [(15, 20)])]  # fmt: skip
BELT = [("link", [(0, 0), (-20, 40), (40, 110), (120, 50), (100, 0)]),
        ("pivot", [(0, 0), (100, 0)]), ("belt", [(0, 0), (100, 0)]),
        ("driver", [(-10, 20)])]  # fmt: skip
# a cam that swings a link by its roller
CAM = [("link", [(70, 60), (-5, 55)]), ("pivot", [(70, 60), (0, 0)]),
       ("cam", [(0, 0), (-5, 55)]), ("force", [(-5, 55, 5, 15)])]  # fmt: skip
EXCAVATOR = [("link", [(0, 0), (120, 100), (210, 70)]), ("point", [(60, 70)]), ("pivot", [(0, 0)]),
             ("cylinder", [(60, 70), (40, -20)]), ("point", [(90, 120), (150, 110)]),
             ("cylinder", [(90, 120), (150, 110)])]  # fmt: skip
TOGGLE = [("link", [(-100, -60), (-70, -50), (-20, -10)]),
          ("link", [(0, 100), (-20, -10), (0, -120)]),
          ("pivot", [(-100, -60), (0, 100)]), ("slider", [(0, -120, 0, -160)]),
          ("driver", [(-85, -55)]), ("force", [(0, -120, 0, -80)]),
          ("spring", [(-70, -50), (80, -50)])]  # fmt: skip
# a crank and a rod to a slider, mirrored in the slider's line
HALF_PRESS = [("link", [(-60, 20), (-90, 90), (0, 140)]), ("pivot", [(-60, 20)]),
              ("slider", [(0, 140, 0, 180)]), ("driver", [(-75, 55)]),
              ("mirror", [(0, -20)])]  # fmt: skip
COUPLER = [*FOUR_BAR, ("point", [(60, 90)])]


DROP = """([text, name]) => {
  const given = new DataTransfer();
  given.items.add(new File([text], name));
  document.getElementById("stage").dispatchEvent(
    new DragEvent("drop", { dataTransfer: given, bubbles: true, cancelable: true }));
}"""


def drop(page, text, name="dropped.toml"):
    """Drop a file; wait until the page has drawn it or said why not."""
    before = page.evaluate("mechdae.opened()")
    page.evaluate(DROP, [text, name])
    until(page, f"mechdae.opened() === {before + 1}")


def at(page, x, y):
    """Return where a place in millimetres is on the screen."""
    box = page.locator("#diagram").bounding_box()
    u, v = page.evaluate(f"mechdae.screen([{x / 1000}, {y / 1000}])")
    return box["x"] + u, box["y"] + v


def drag(page, begin, end):
    """Press at a place, move, release at another one; in millimetres."""
    page.mouse.move(*at(page, *begin))
    page.mouse.down()
    page.mouse.move(*at(page, *end), steps=4)
    page.mouse.up()


def draw(page, steps):
    """Draw by clicks at (x, y) and ways (x, y, to x, to y), in millimetres; return how many."""
    count = 0
    for tool, places in steps:
        page.locator(f"[data-tool={tool}]").click()
        for place in places:
            if len(place) == 2:
                page.mouse.click(*at(page, *place))
            else:
                drag(page, place[:2], place[2:])
        page.keyboard.press("Escape")
        count += 1 + len(places)
    return count


def out(page, factor):
    """Turn the wheel over the middle of the sheet until it shows about `factor` times as much."""
    box = page.locator("#diagram").bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.wheel(0, 100 * (factor - 1) * 4.6)


def same(page, result, k):
    """Compare everything that the page tells of a pose with a result of Python.

    Return how many series, the pose, and the largest difference as a share of its series.
    """
    pose = page.evaluate("mechdae.pose()")
    assert pose["bound"]["length"] < 1e-10
    count, worst = 0, 0.0
    for path, values in pose["outputs"].items():
        kind, part, name = path.split("/")
        table = getattr(result, kind)
        if part not in table or name not in table[part]:
            continue
        shown, series = np.asarray(values), np.asarray(table[part][name])
        if name == "angle":
            shown = shown - 2 * np.pi * np.round((shown - series[k]) / (2 * np.pi))
        off = np.abs(shown - series[k]).max() / max(np.nanmax(np.abs(series)), 1e-3)
        assert off <= 1e-8, path
        count, worst = count + 1, max(worst, float(off))
    return count, pose, worst


def as_python(page, file):
    """Save what is drawn and compare its poses, forces too, with what Python solves of the file.

    Return how many poses and the largest difference, as a share of its series.
    """
    file.write_text(page.evaluate("mechdae.toml()"), encoding="utf-8")
    problem = md.load(file)
    led = problem.task("window").all_drivers
    assert [own.coordinate for own in led] == page.evaluate("mechdae.state().drivers")
    if len(led) > 1:
        return _led(page, problem, led)
    values = page.evaluate("mechdae.values()")
    assert len(values) > 300
    chosen = values[20:-20:40]
    driver = md.Driver(led[0].coordinate, at=tuple(chosen))
    result = md.solve(problem.mechanism, md.Sweep(driver=driver))
    assert set(result.status) == {"ok"}
    loaded = "forces" in problem.tasks
    acting = md.solve(problem.mechanism, md.Reactions(driver=driver)) if loaded else None
    most = 0.0
    for k, value in enumerate(chosen):
        assert page.evaluate(f"mechdae.set({value!r})") is True
        count, pose, worst = same(page, result, k)
        assert count > 15
        most = max(most, worst)
        if acting is None:
            continue
        efforts = acting.efforts[driver.coordinate]
        effort, largest = pose["forces"]["efforts"][driver.coordinate], np.abs(efforts).max()
        assert effort == pytest.approx(efforts[k], abs=1e-8 * largest)
        most = max(most, float(abs(effort - efforts[k]) / largest))
        for name, reaction in pose["forces"]["reactions"].items():
            assert reaction == pytest.approx(acting.joints[name].reaction[k], abs=1e-6)
    return len(chosen), most


def _led(page, problem, led):
    """Two cylinders moved together, each way from where they are drawn."""
    begun, worst = [own.from_ for own in led], 0.0
    for u in ([begun[0] + 0.01, begun[1] + 0.004], [begun[0] - 0.01, begun[1] - 0.003]):
        ways = [
            md.Driver(own.coordinate, at=(a, b)) for own, a, b in zip(led, begun, u, strict=True)
        ]
        result = md.solve(problem.mechanism, md.Sweep(drivers=ways))
        assert page.evaluate(f"mechdae.lead({u})") is True
        points = page.evaluate("mechdae.pose().points")
        for name, series in result.points.items():
            off = np.abs(series.position[1] - points[name]).max()
            assert off < 1e-9
            worst = max(worst, float(off))
    return 2, worst
