"""The editor: drawn by pointer events, exported, solved by Python; undo; files that are opened."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from mechdae.parts.page.document import data_of
from mechdae.parts.page.editor import editor
from tests.shared.browser import ARGUMENTS, CHROMIUM, until
from tests.shared.command import run
from tests.shared.paths import ROOT

in_browser = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")

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


@pytest.fixture(scope="module")
def browser():
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with playwright.sync_playwright() as own:
        opened = own.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield opened
        opened.close()


@pytest.fixture
def drawing(browser, tmp_path):
    """Open the editor; afterwards nothing was said."""
    said: list[str] = []
    contexts = []

    def open_editor(problem=None):
        context = browser.new_context(viewport={"width": 1000, "height": 900})
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda message: said.append(message.text))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.goto(f"file://{editor(problem).save(tmp_path / 'editor.html')}")
        return page

    yield open_editor
    for context in contexts:
        context.close()
    assert said == []


def draw(page, steps):
    """Draw by clicks; places in millimetres."""
    box = page.locator("#diagram").bounding_box()
    for tool, places in steps:
        page.locator(f"[data-tool={tool}]").click()
        for x, y in places:
            u, v = page.evaluate(f"mechdae.screen([{x / 1000}, {y / 1000}])")
            page.mouse.click(box["x"] + u, box["y"] + v)
        page.keyboard.press("Escape")


@in_browser
@pytest.mark.parametrize(
    ("steps", "bodies"),
    [(FOUR_BAR, 3), (SEVEN_LINK, 7), (TRIAD, 5), (WELDED, 3)],
    ids=["four-bar", "seven-link", "triad", "weld and bar"],
)
def test_what_is_drawn_is_what_python_solves(drawing, tmp_path, steps, bodies):
    page = drawing()
    draw(page, steps)
    assert page.evaluate("mechdae.mobility()") == {"count": 1, "rank": 1, "without": []}
    file = tmp_path / "drawn.toml"
    file.write_text(page.evaluate("mechdae.toml()"), encoding="utf-8")
    problem = md.load(file)
    values = page.evaluate("mechdae.values()")
    assert len(values) > 60
    chosen = values[2 : -2 : max(1, len(values) // 12)]
    driver = problem.task("window").driver.coordinate
    result = md.solve(problem.mechanism, md.Sweep(driver=md.Driver(driver, at=tuple(chosen))))
    assert set(result.status) == {"ok"}
    assert len(result.bodies) in (bodies, bodies - 1)  # a slider of one point is a body there
    for k, value in enumerate(chosen):
        assert page.evaluate(f"mechdae.set({value!r})") is True
        points = page.evaluate("mechdae.pose().points")
        for name, series in result.points.items():
            if name in points:
                assert np.abs(series.position[k] - points[name]).max() < 1e-9
    assert len(set(points) & set(result.points)) >= 2 * (bodies - 2)
    page.locator("input[type=file]").set_input_files(file)
    until(page, "mechdae.opened() === 1")
    assert page.evaluate("mechdae.state().file") == {
        "title": problem.title,
        "kept": [],
        "names": [],
    }
    assert page.evaluate("mechdae.toml()") == file.read_text(encoding="utf-8")


@in_browser
@pytest.mark.parametrize("steps", [FOUR_BAR, WELDED], ids=["four-bar", "weld and bar"])
def test_undo_to_nothing_and_back_gives_the_same_file(drawing, steps):
    page = drawing()
    empty = page.evaluate("mechdae.toml()")
    draw(page, steps)
    whole, count = page.evaluate("mechdae.toml()"), 0
    while page.evaluate("mechdae.state().nodes.length"):
        page.keyboard.press("Control+z")
        count += 1
        assert count < 30
    assert page.evaluate("mechdae.toml()") == empty
    for _ in range(count):
        page.keyboard.press("Control+Shift+z")
    assert page.evaluate("mechdae.toml()") == whole


@in_browser
def test_bars_and_welds_are_taken_back_by_their_tool_and_go_with_their_points(drawing):
    page = drawing()
    draw(page, WELDED)
    state = "[mechdae.state().bars.length, mechdae.state().nodes.flatMap((n) => n.welds).length]"
    assert page.evaluate(state) == [1, 1]
    draw(page, [("weld", [(120, 80)])])
    assert page.evaluate(state) == [1, 0]
    assert page.evaluate("mechdae.mobility().count") == 2
    assert "too few joints" in page.locator("#status").inner_text()
    draw(page, [("weld", [(120, 80)]), ("bar", [(150, 120), (100, -5)])])
    assert page.evaluate(state) == [0, 1]
    page.keyboard.press("Control+z")
    assert page.evaluate(state) == [1, 1]
    draw(page, [("delete", [(125, 57)])])  # on the bar
    assert page.evaluate(state) == [0, 1]
    page.keyboard.press("Control+z")
    draw(page, [("delete", [(140, 107)])])  # the link at its end
    assert page.evaluate(state) == [0, 0]


@in_browser
def test_a_point_dropped_on_another_joins_them_in_one_gesture(drawing):
    page = drawing()
    draw(page, [("link", [(0, 0), (20, 40)]), ("link", [(120, 80), (100, 0)])])
    box = page.locator("#diagram").bounding_box()
    (a, b), (c, d) = (
        page.evaluate(f"mechdae.screen([{x}, {y}])") for x, y in ((0.02, 0.04), (0.12, 0.08))
    )
    page.mouse.move(box["x"] + a, box["y"] + b)
    page.mouse.down()
    page.mouse.move(box["x"] + c, box["y"] + d, steps=4)
    page.mouse.up()
    assert page.evaluate("mechdae.state().nodes.length") == 3
    page.keyboard.press("Control+z")
    assert page.evaluate("mechdae.state().nodes.length") == 4


@in_browser
def test_what_cannot_move_says_why(drawing):
    page = drawing()
    draw(page, FOUR_BAR)
    draw(page, [("link", [(20, 40), (100, 0)])])
    found = page.evaluate("mechdae.mobility()")
    assert found["count"] == 0
    assert "too many joints" in page.locator("#status").inner_text()
    page.keyboard.press("Control+z")
    assert "turns fully" in page.locator("#status").inner_text()


@in_browser
def test_beyond_a_limit_the_gap_is_shown(drawing):
    page = drawing(md.load("four-bar-double-rocker"))
    values = page.evaluate("mechdae.values()")
    limits = md.solve("four-bar-double-rocker", "window").summary["limits"]
    assert [values[0], values[-1]] == pytest.approx(limits, abs=1e-3)
    assert page.evaluate(f"mechdae.set({values[-1] + 0.2})") is False
    assert page.evaluate("mechdae.pose().gap") > 1e-4
    assert "does not close at" in page.locator("#status").inner_text()


@in_browser
@pytest.mark.parametrize("name", ["gorshkov-seven-link", "jansen-leg", "slider-crank"])
def test_opened_files_come_out_as_they_move(drawing, tmp_path, name):
    page = drawing(md.load(name))
    file = tmp_path / "again.toml"
    file.write_text(page.evaluate("mechdae.toml()"), encoding="utf-8")
    again = md.load(file)
    value = page.evaluate("mechdae.values()")[5]
    driver = again.task("window").driver.coordinate
    one, other = (
        md.solve(own.mechanism, md.Sweep(driver=md.Driver(driver, at=(value,))))
        for own in (again, md.load(name))
    )
    shared = set(one.bodies) & set(other.bodies)
    assert len(shared) >= 2
    places = {tuple(np.round(own.position[0], 9) + 0.0) for own in other.points.values()}
    assert {tuple(np.round(own.position[0], 9) + 0.0) for own in one.points.values()} <= places


WELDED_FILE = """
schema = 1
[parameters]
tilt_deg = 35
long_mm = 160
[ground]
points = { O = [0, 0], D = [0.1, 0] }
[bodies]
crank.points = { O = [0, 0], A = [0.03, 0.02] }
coupler.points = { A = [0.01, 0], B = [0.12, 0.01] }
arm.points = { B = [0, 0], C = [0.03, 0.01], E = [0.06, -0.02] }
tail.points = { E = [0, 0], F = [0.02, 0] }
[joints]
O = { kind = "revolute", between = ["ground.O", "crank.O"] }
A = { kind = "revolute", between = ["crank.A", "coupler.A"] }
B = { kind = "weld", between = ["coupler.B", "arm.B"], turn = "tilt" }
E = { kind = "weld", between = ["tail.E", "arm.E"], turn_deg = -20 }
bar = { kind = "distance", between = ["ground.D", "arm.C"], length = "long" }
[sketch]
coupler = 0.2
arm = 0.8
[tasks.turn]
kind = "sweep"
driver = { coordinate = "O.angle", from_deg = 20, to_deg = 60 }
poses = 5
"""


@in_browser
def test_welds_and_bars_of_a_file_move_as_python_moves_them(drawing, tmp_path):
    file = tmp_path / "welded.toml"
    file.write_text(WELDED_FILE, encoding="utf-8")
    page = drawing(file)
    drawn = "crank coupler arm tail O A B E bar".split()
    said = page.locator("#kept").inner_text().split(": ")[1].split(", ")
    assert not any(name.split(".")[1] in drawn for name in said)
    assert page.evaluate("mechdae.mobility()") == {"count": 1, "rank": 1, "without": []}
    again = tmp_path / "again.toml"
    again.write_text(page.evaluate("mechdae.toml()"), encoding="utf-8")
    truth, saved = md.load(file), md.load(again)
    assert sorted(joint.kind for joint in saved.mechanism.joints.values()) == [
        "distance", "revolute", "revolute", "weld", "weld",
    ]  # fmt: skip
    # links are turned into their own frames: the crank by its angle from the first to the second
    shift = float(np.arctan2(0.02, 0.03))
    values = page.evaluate("mechdae.values()")[3::60]
    one = md.solve(
        truth.mechanism, md.Sweep(driver=md.Driver("O.angle", at=tuple(np.array(values) - shift)))
    )
    other = md.solve(saved.mechanism, md.Sweep(driver=md.Driver("crank.angle", at=tuple(values))))
    for name, series in one.points.items():
        if name in other.points:
            assert np.abs(series.position - other.points[name].position).max() < 1e-9
    assert {"arm.C", "tail.F"} <= set(one.points) & set(other.points)
    page.locator("input[type=file]").set_input_files(again)
    until(page, "mechdae.opened() === 1")
    assert page.evaluate("mechdae.toml()") == again.read_text(encoding="utf-8")


@in_browser
def test_a_file_that_cannot_be_drawn_is_named_when_the_editor_opens(drawing):
    page = drawing("spur-gears-idler")
    said = page.locator("#status").inner_text()
    assert said == "spur-gears-idler.toml: no links that the editor draws"
    assert page.evaluate("mechdae.state().nodes") == []


def test_files_are_opened_by_the_page_and_those_that_are_none_refused(capsys, tmp_path):
    out = str(tmp_path / "editor.html")
    for name in ("geared-five-bar", "scotch-yoke-jam", "oscillating-cylinder"):
        code, printed, _ = run(capsys, "edit", name, "--out", out)
        assert code == 0
        text = (ROOT / f"problems/{name}.toml").read_text(encoding="utf-8")
        assert data_of(printed.strip())["text"] == text
    code, printed, _ = run(capsys, "edit", "--out", out)
    assert code == 0
    assert data_of(printed.strip())["text"] == ""
    large = tmp_path / "large.toml"
    large.write_text(WELDED_FILE + "#" * 200_000, encoding="utf-8")
    broken = tmp_path / "broken.toml"
    broken.write_text("schema = 1\n[bodies", encoding="utf-8")
    for words, said in (
        (["bennett"], "planar"),
        ([str(large)], "200 kB"),
        ([str(broken)], "broken.toml"),
        (["four-bar-crank-rockr"], "did you mean"),
        (["--lang", "fr"], "en, ru"),
        (["--out", str(tmp_path / "no" / "x.html")], "no such folder"),
    ):
        code, _, err = run(capsys, "edit", *words, *([] if "--out" in words else ["--out", out]))
        assert code == 2, words
        assert said in err
