"""The editor: drawn by pointer events, exported, solved by Python; undo; files that are opened."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from mechdae.pages.document import data_of
from mechdae.pages.editor import editor
from tests.shared.browser import ARGUMENTS, CHROMIUM, until
from tests.shared.command import run

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
    [(FOUR_BAR, 3), (SEVEN_LINK, 7), (TRIAD, 5)],
    ids=["four-bar", "seven-link", "triad"],
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
def test_undo_to_nothing_and_back_gives_the_same_file(drawing):
    page = drawing()
    draw(page, FOUR_BAR)
    whole, steps = page.evaluate("mechdae.toml()"), 0
    while page.evaluate("mechdae.state().nodes.length"):
        page.keyboard.press("Control+z")
        steps += 1
        assert steps < 30
    for _ in range(steps):
        page.keyboard.press("Control+Shift+z")
    assert page.evaluate("mechdae.toml()") == whole


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


def test_what_is_not_drawn_is_named(capsys, tmp_path):
    out = str(tmp_path / "editor.html")
    code, _, err = run(capsys, "edit", "geared-five-bar", "--out", out)
    assert code == 2
    assert "joints." in err
    assert "gear" in err
    for name, key in (("scotch-yoke-jam", "joints.guide"), ("oscillating-cylinder", "bodies.")):
        code, _, err = run(capsys, "edit", name, "--out", out)
        assert (code, key in err) == (2, True)
    data = editor(md.load("slider-crank-friction")).data
    assert "loads.work" in data["names"]
    assert any("Q_work" in line for line in data["kept"])
    code, printed, _ = run(capsys, "edit", "--out", out)
    assert code == 0
    assert data_of(printed.strip())["model"] is None
    assert run(capsys, "edit", "--out", str(tmp_path / "no" / "x.html"))[0] == 2
    assert run(capsys, "edit", "bennett", "--out", out)[0] == 2
    assert run(capsys, "edit", "--lang", "fr", "--out", out)[0] == 2
