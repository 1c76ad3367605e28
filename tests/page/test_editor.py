"""The editor: drawn by pointer events, exported, solved by Python; undo; what cannot be."""

from __future__ import annotations

import struct
import tomllib
import zlib

import numpy as np
import pytest

import mechdae as md
from mechdae.parts.page.editor import editor
from tests.shared import drawing as drawn
from tests.shared.browser import ARGUMENTS, CHROMIUM, loaded, until
from tests.shared.command import run
from tests.shared.drawing import FOUR_BAR, WELDED, at, drag, draw
from tests.shared.gestures import played
from tests.shared.page_data import data_of
from tests.shared.paths import ROOT

in_browser = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")


@pytest.fixture(scope="module")
def browser():
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with playwright.sync_playwright() as own:
        opened = own.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield opened
        opened.close()


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Return the page of a problem, written once."""
    folder, made = tmp_path_factory.mktemp("editors"), {}

    def file(problem=None):
        key = str(problem)
        if key not in made:
            made[key] = editor(problem).save(folder / f"{len(made)}.html")
        return made[key]

    return file


@pytest.fixture
def drawing(browser, files):
    """Open the editor; afterwards nothing was said and nobody asked."""
    said: list[str] = []
    contexts = []

    def open_editor(problem=None):
        context = browser.new_context(viewport={"width": 1000, "height": 900})
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda message: said.append(message.text))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.on("request", lambda request: said.append(request.url)
                if not request.url.startswith(("file:", "blob:", "data:")) else None)  # fmt: skip
        loaded(page, files(problem))
        return page

    yield open_editor
    for context in contexts:
        context.close()
    assert said == []


def said(page):
    return page.locator("#status").inner_text()


@in_browser
@pytest.mark.parametrize(
    ("steps", "clicks"),
    [(drawn.COUPLER, 12), (drawn.SLIDER_CRANK, 10), (drawn.WATT, 17), (drawn.GEARED, 14),
     (drawn.RACK, 13), (drawn.BELT, 14), (drawn.TOGGLE, 20), (drawn.SEVEN_LINK, 24),
     (drawn.TRIAD, 21), (WELDED, 18), (drawn.CAM, 11)],
    ids=["four-bar", "slider-crank", "Watt", "geared", "rack", "belt", "toggle", "seven-link",
         "triad", "welded", "cam"],
)  # fmt: skip
def test_what_is_drawn_is_what_python_solves(drawing, tmp_path, steps, clicks):
    page = drawing()
    drawn.out(page, 1.6)
    assert draw(page, steps) == clicks
    assert page.evaluate("mechdae.mobility()") == {"count": 1, "rank": 1, "without": []}
    drawn.as_python(page, tmp_path / "drawn.toml")
    file = tmp_path / "drawn.toml"
    slanted = steps is drawn.SLIDER_CRANK
    assert ("axis_deg = 30 }" in file.read_text(encoding="utf-8")) == slanted
    # lengths are parameters with at most two decimals of a millimetre
    assert all(len(str(round(1000 * value, 9)).partition(".")[2]) <= 2
               for value in md.load(file).mechanism.parameters.values())  # fmt: skip
    page.locator("input[accept='.toml']").set_input_files(file)
    until(page, "mechdae.opened() === 1")
    assert page.evaluate("mechdae.toml()") == file.read_text(encoding="utf-8")


@in_browser
def test_forces_on_a_link_are_a_closed_polygon(drawing):
    """Its reactions; where a force acts on it also that; the spring is as long as without one."""
    page = drawing()
    drawn.out(page, 1.6)
    draw(page, drawn.TOGGLE)
    data = tomllib.loads(page.evaluate("mechdae.toml()"))
    ends = [own.split(".")[0] for joint in data["joints"].values() for own in joint["between"]]
    (load,) = (own for own in data["loads"].values() if own["kind"] == "force")
    page.locator("#tab-plans").click()
    for name in data["bodies"]:
        page.locator("#plans select").select_option(label=f"forces on {name}")
        kinds = [page.locator(f".plan .vector.{kind}").count() for kind in ("reaction", "inner")]
        assert kinds == [ends.count(name), name == load["point"].split(".")[0]]


@in_browser
def test_cylinders_drive_an_excavator_arm(drawing, tmp_path):
    page = drawing()
    assert draw(page, drawn.EXCAVATOR) == 17
    assert page.evaluate("mechdae.mobility()") == {"count": 2, "rank": 2, "without": []}
    file = tmp_path / "drawn.toml"
    drawn.as_python(page, file)
    problem = md.load(file)
    assert md.solve(problem, "window").status[-1] == "ok"


@in_browser
def test_escape_and_double_click_end_the_link_and_nothing_is_lost(drawing):
    page = drawing()
    page.locator("[data-tool=link]").click()
    for place in [(0, 0), (20, 40), (120, 80)]:
        page.mouse.click(*at(page, *place))
    page.mouse.dblclick(*at(page, 100, 0))
    state = page.evaluate("mechdae.state()")
    assert (state["tool"], len(state["links"])) == ("link", 3)
    page.mouse.click(*at(page, 70, 60))  # on the coupler: a point of it, whatever follows
    page.keyboard.press("Escape")
    state = page.evaluate("mechdae.state()")
    assert state["tool"] == "link"
    assert [len(own["points"]) for own in state["links"]] == [2, 3, 2]
    page.mouse.click(*at(page, 200, 20))
    page.keyboard.press("Escape")
    assert said(page) == "a link needs two points: nothing was drawn"
    assert page.evaluate("mechdae.state().nodes.length") == 5
    page.mouse.click(*at(page, 200, 20))
    page.mouse.click(*at(page, 200, 80))  # the tool is still there
    assert page.evaluate("mechdae.state().links.length") == 4


@in_browser
@pytest.mark.parametrize("steps", [WELDED, drawn.EXCAVATOR], ids=["weld and bar", "cylinders"])
def test_undo_to_nothing_and_back_gives_the_same_file(drawing, steps):
    page = drawing()
    empty = page.evaluate("mechdae.toml()")
    draw(page, steps)
    whole, count = page.evaluate("mechdae.toml()"), 0
    while page.evaluate("mechdae.toml()") != empty:
        page.keyboard.press("Control+z")
        count += 1
        assert count < 30
    for _ in range(count):
        page.keyboard.press("Control+Shift+z")
    assert page.evaluate("mechdae.toml()") == whole


@in_browser
def test_bars_and_welds_are_taken_back_by_their_tool_and_go_with_their_points(drawing):
    page = drawing()
    draw(page, WELDED)

    def kinds():
        joints = page.evaluate("mechdae.state().joints")
        return [sum(kind == own for _, kind in joints) for own in ("distance", "weld")]

    assert kinds() == [1, 1]
    draw(page, [("weld", [(120, 80)])])
    assert kinds() == [1, 0]
    assert page.evaluate("mechdae.mobility().count") == 2
    assert "too few joints" in said(page)
    draw(page, [("weld", [(120, 80)]), ("bar", [(150, 120), (100, -5)])])
    assert kinds() == [0, 1]
    page.keyboard.press("Control+z")
    assert kinds() == [1, 1]
    draw(page, [("delete", [(125, 57)])])  # on the bar
    assert kinds() == [0, 1]
    page.keyboard.press("Control+z")
    draw(page, [("delete", [(140, 107)])])  # the link at its end
    assert kinds() == [0, 0]
    assert "bar1" not in page.evaluate("mechdae.toml()")


@in_browser
def test_what_is_deleted_takes_its_numbers_sketch_and_tasks_along(drawing, tmp_path):
    page = drawing()
    draw(page, drawn.EXCAVATOR)
    draw(page, [("delete", [(50, 25)])])  # the cylinder below the boom
    data = tomllib.loads(page.evaluate("mechdae.toml()"))
    assert list(data["bodies"]) == ["link1", "link2", "cylinder2", "rod2"]
    assert list(data["joints"]) == ["B", "A", "F", "G", "stroke2"]
    assert set(data["sketch"]) == {"link1_deg", "link2_deg", "cylinder2_deg", "rod2_deg",
                                   "stroke2_mm"}  # fmt: skip
    assert data["ground"]["points"] == {"A": ["A_x", "A_y"]}
    assert not any(name.startswith("E_") for name in data["parameters"])
    assert data["tasks"]["window"]["driver"]["coordinate"] == "stroke2.slide"
    page = drawing()
    draw(page, drawn.GEARED)
    page.locator("#properties button:has-text('Delete')").click()
    assert page.evaluate("mechdae.mobility().count") == 2
    draw(page, [("delete", [(100, 0)])])  # a pivot: the link there has one point left
    data = tomllib.loads(page.evaluate("mechdae.toml()"))
    assert list(data["bodies"]) == ["link1", "link2", "link3"]
    assert not any(name.startswith(("E_", "link4")) for name in data["parameters"])
    draw(page, [("driver", [(-10, 20)])])
    assert "tasks" not in tomllib.loads(page.evaluate("mechdae.toml()"))


@in_browser
def test_a_point_dropped_on_another_joins_them_in_one_gesture(drawing):
    page = drawing()
    draw(page, [("link", [(0, 0), (20, 40)]), ("link", [(120, 80), (100, 0)])])
    page.locator("[data-tool=select]").click()
    drag(page, (20, 40), (120, 80))
    assert page.evaluate("mechdae.state().nodes.length") == 3
    page.keyboard.press("Control+z")
    assert page.evaluate("mechdae.state().nodes.length") == 4


@in_browser
def test_what_cannot_move_says_why(drawing):
    page = drawing()
    draw(page, FOUR_BAR)
    draw(page, [("link", [(20, 40), (100, 0)])])
    assert page.evaluate("mechdae.mobility().count") == 0
    assert "too many joints" in said(page)
    page.keyboard.press("Control+z")
    assert "turns fully" in said(page)
    draw(page, [("link", [(200, 20), (230, 60)])])
    assert "not connected with the ground: link4" in said(page)
    page.keyboard.press("Control+z")
    draw(page, [("pivot", [(200, 100)])])
    assert "a pivot without a link: E" in said(page)
    page.keyboard.press("Control+z")
    draw(page, [("driver", [(10, 20)])])
    assert "no driver yet" in said(page)
    page.keyboard.press("Control+z")
    draw(page, [("pivot", [(100, 0)])])
    assert "too few joints or drivers" in said(page)


def field(page, label):
    return page.locator(f"#properties input[aria-label='{label}']")


def typed(page, label, text):
    field(page, label).fill(text)
    field(page, label).press("Enter")


@in_browser
def test_lengths_angles_names_and_masses_are_typed(drawing, tmp_path):
    page = drawing()
    draw(page, FOUR_BAR)
    page.locator("[data-tool=select]").click()
    page.mouse.click(*at(page, 10, 20))
    typed(page, "AB [mm]", "45,5")
    assert "link1_AB_mm = 45.5" in page.evaluate("mechdae.toml()")
    typed(page, "angle [°]", "80")
    assert field(page, "angle [°]").input_value() == "80"
    before = page.evaluate("mechdae.toml()")
    for text, words in (("400", "do not close"), ("0", "above zero"), ("-3", "above zero"),
                        ("x", '"x" is no number')):  # fmt: skip
        typed(page, "AB [mm]", text)
        assert words in said(page)
        assert page.evaluate("mechdae.toml()") == before
    typed(page, "name", "crank")
    typed(page, "mass [kg]", "0.2")
    typed(page, "centre x [mm]", "20")
    page.mouse.click(
        *at(page, *(1000 * v for v in page.evaluate("mechdae.pose().points['link2.C']")))
    )
    typed(page, "name", "Q")
    file = tmp_path / "named.toml"
    file.write_text(page.evaluate("mechdae.toml()"), encoding="utf-8")
    mechanism = md.load(file).mechanism
    assert list(mechanism.bodies) == ["crank", "link2", "link3"]
    assert set(mechanism.bodies["link3"].points) == {"Q", "D"}
    assert mechanism.bodies["crank"].mass == 0.2
    assert mechanism.bodies["crank"].center == (0.02, 0.0)
    assert set(md.solve(md.load(file), "window").status) <= {"ok", "limit"}


@in_browser
def test_a_link_is_copied_with_its_masses(drawing):
    """Ctrl+D: the same points and masses beside it."""
    page = drawing()
    draw(page, drawn.COUPLER)
    page.locator("[data-tool=select]").click()
    page.mouse.click(*at(page, 70, 60))
    typed(page, "mass [kg]", "2.5")
    page.keyboard.press("Control+d")
    data = tomllib.loads(page.evaluate("mechdae.toml()"))
    known = {name.removesuffix("_mm"): value for name, value in data["parameters"].items()}
    one, two = (data["bodies"][name] for name in ("link2", "link4"))
    assert two["mass"] == one["mass"] == 2.5
    places = [
        [[known.get(v, v) for v in own] for own in link["points"].values()] for link in (one, two)
    ]
    assert len(places[0]) == 3
    assert np.abs(np.subtract(*places)).max() < 0.011  # rounded to a hundredth of a millimetre
    page.keyboard.press("Control+z")
    assert "link4" not in page.evaluate("mechdae.toml()")


@in_browser
def test_locked_lengths_stay_when_points_are_moved(drawing):
    page = drawing()
    draw(page, FOUR_BAR)
    page.locator("[data-tool=select]").click()
    page.mouse.click(*at(page, 10, 20))
    page.locator("#properties input[aria-label='hold AB']").check()
    drag(page, (20, 40), (60, 60))
    text = page.evaluate("mechdae.toml()")
    assert "# locked: AB" in text
    assert "link1_AB_mm = 44.72\n" in text
    x, y = page.evaluate("mechdae.pose().points['link1.B']")
    assert np.arctan2(y, x) == pytest.approx(np.pi / 4, abs=0.02)
    page.keyboard.press("Control+z")
    page.mouse.click(*at(page, 10, 20))
    page.locator("#properties input[aria-label='hold AB']").uncheck()
    drag(page, (20, 40), (30, 40))
    assert "link1_AB_mm = 50\n" in page.evaluate("mechdae.toml()")


@in_browser
def test_beyond_a_limit_the_gap_is_shown(drawing):
    page = drawing("four-bar-double-rocker")
    values = page.evaluate("mechdae.values()")
    limits = md.solve("four-bar-double-rocker", "window").summary["limits"]
    assert [values[0], values[-1]] == pytest.approx(limits, abs=0.01)
    assert page.evaluate(f"mechdae.set({values[-1] + 0.2})") is False
    assert page.evaluate("mechdae.pose().gap") > 1e-4
    assert "does not close at" in said(page)


def png_part(kind, data):
    """Return a part of a PNG file."""
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


LATE = """window.ResizeObserver = class {
  constructor(act) { window.resized = act; }
  observe() {}
};"""


@in_browser
@pytest.mark.parametrize("wide", [1000, 1280])
def test_the_sheet_lies_where_its_final_layout_has_it_and_tools_leave_it_there(
    browser, files, wide
):
    page = browser.new_page(viewport={"width": wide, "height": 900})
    page.add_init_script(LATE)  # as long as a slow browser has drawn no frame
    loaded(page, files())
    place = at(page, 50, 50)
    page.evaluate("resized()")
    assert at(page, 50, 50) == pytest.approx(place, abs=1e-6)
    for tool in page.locator("#tools [data-tool]:not([data-tool=find])").all():
        tool.click()
        page.evaluate("resized()")
        assert at(page, 50, 50) == pytest.approx(place, abs=1e-6), said(page)
    page.close()


@in_browser
def test_wheel_and_drag_move_the_sheet_and_a_photo_lies_to_scale(drawing, tmp_path):
    page = drawing()
    place = at(page, 50, 50)
    page.mouse.move(*place)
    page.mouse.wheel(0, -600)
    assert at(page, 50, 50) == pytest.approx(place, abs=0.8)
    assert at(page, 60, 50)[0] - place[0] > 40
    drag(page, (50, 50), (55, 55))
    assert at(page, 50, 50)[0] - place[0] > 20
    header = png_part(b"IHDR", struct.pack(">2I5B", 2, 1, 8, 2, 0, 0, 0))
    dots = png_part(b"IDAT", zlib.compress(bytes(7)))
    photo = tmp_path / "photo.png"
    photo.write_bytes(b"\x89PNG\r\n\x1a\n" + header + dots + png_part(b"IEND", b""))
    page.locator("#tab-file").click()
    page.locator("#photo-file").set_input_files(photo)
    until(page, "document.querySelector('.backdrop image').getAttribute('display') === 'inline'")
    width = "Number(document.querySelector('.backdrop image').getAttribute('width'))"
    before = page.evaluate(width)
    page.locator("#photo [data-tool=measure]").click()
    for place in [(40, 50), (50, 50)]:
        page.mouse.click(*at(page, *place))
    assert page.evaluate(width) == pytest.approx(10 * before, rel=1e-3)


@pytest.mark.slow
@in_browser
@pytest.mark.parametrize("seed", [203, 305])
def test_random_gestures_leave_a_drawing_that_python_reads_and_solves_the_same(
    browser, files, seed, tmp_path
):
    gestures = played(browser, files(), seed, 20, tmp_path)
    assert gestures.faults == []


@in_browser
def test_templates_are_a_start(drawing):
    page = drawing()
    names = page.evaluate("JSON.parse(document.getElementById('mechdae').textContent).templates")
    assert len(names) == 9
    for k in range(9):
        page.locator("#acts select").select_option(str(k))
        assert len(page.evaluate("mechdae.values()")) > 100, said(page)
        page.locator("#tab-curves").click()
        assert page.locator("#curves svg .curve").count() >= 3
        shown = page.locator("#curves .chip output").inner_text()
        assert any(unit in shown for unit in (" mm", "°"))
        page.locator("#tab-plans").click()
        page.locator("#plans select").select_option("1")
        assert page.locator("#plans svg path").count() > (0 if "cam" in names[k]["name"] else 1)


@in_browser
def test_mirrored_halves_share_dimensions_and_the_points_on_the_line(drawing, files, tmp_path):
    """Half a press with its slider on the line; a four-bar with its pivot on a slanted one."""
    page = drawing()
    drawn.out(page, 1.8)
    draw(page, drawn.HALF_PRESS)
    assert page.evaluate("mechdae.mobility()") == {"count": 1, "rank": 1, "without": []}
    drawn.as_python(page, tmp_path / "press.toml")
    page.locator("[data-tool=select]").click()
    page.mouse.click(*at(page, -75, 55))
    typed(page, "AB [mm]", "80")  # of both halves
    places = page.evaluate("mechdae.pose().points")
    for one, two in (("link1.A", "link1_1.D"), ("link1.B", "link1_1.E")):
        (x, y), (u, v) = places[one], places[two]
        assert [u, v] == pytest.approx([-x, y], abs=1e-9)
    assert places["link2.C"] == pytest.approx(places["link2_1.C"], abs=1e-12)
    page = drawing()
    drawn.out(page, 1.8)
    draw(page, [*drawn.COUPLER, ("mirror", [(-40, -40, 60, 60)])])
    places = page.evaluate("mechdae.pose().points")
    mirrored = {(round(x, 5), round(y, 5)) for y, x in places.values()}
    assert {(round(x, 5), round(y, 5)) for x, y in places.values()} == mirrored
    for steps, line, twin in ((drawn.GEARED, (-40, 0), (-70, 20)),
                              (drawn.RACK, (-40, -60, 60, 40), (40, -5))):  # fmt: skip
        loaded(page, files())
        drawn.out(page, 1.8)
        draw(page, [*steps, ("mirror", [line]), ("driver", [twin])])
        assert page.evaluate("mechdae.mobility()") == {"count": 2, "rank": 2, "without": []}
        drawn.as_python(page, tmp_path / "wheels.toml")


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
    assert page.locator("#kept").inner_text() == ""
    assert page.evaluate("mechdae.mobility()") == {"count": 1, "rank": 1, "without": []}
    assert page.evaluate("mechdae.toml()") == WELDED_FILE
    values = page.evaluate("mechdae.values()")[3::60]
    driver = md.Driver("O.angle", at=tuple(values))
    result = md.solve(md.load(file).mechanism, md.Sweep(driver=driver))
    for k, value in enumerate(values):
        assert page.evaluate(f"mechdae.set({value!r})") is True
        assert drawn.same(page, result, k)[0] > 20


@in_browser
def test_links_are_renamed_wherever_the_file_names_them(drawing, tmp_path):
    """Headers, headers of their points, joints, the sketch; what is said stays."""
    points = "points = { B = [0, 0], C = [0.03, 0.01], E = [0.06, -0.02] }"
    head = "[bodies.arm]\nmass = 1  # of the arm\n[bodies.arm.points]\n"
    head += points.removeprefix("points = { ").removesuffix(" }").replace("], ", "]\n")
    text = WELDED_FILE.replace(f"arm.{points}\n", "")
    text = text.replace("tail.points", f"{head}\n[bodies.tail]\npoints")
    file = tmp_path / "headed.toml"
    file.write_text(text, encoding="utf-8")
    page = drawing(file)
    before = page.evaluate("mechdae.pose().points")
    middle = np.add(before["arm.C"], before["arm.E"]) * 500
    page.mouse.click(*at(page, *middle.tolist()))
    typed(page, "name", "lever")
    text = page.evaluate("mechdae.toml()")
    assert (text.count("arm"), text.count("# of the arm")) == (1, 1)
    file.write_text(text, encoding="utf-8")
    mechanism = md.load(file).mechanism
    assert list(mechanism.bodies) == ["crank", "coupler", "lever", "tail"]
    assert list(mechanism.bodies["lever"].points) == ["B", "C", "E"]
    after = page.evaluate("mechdae.pose().points")
    assert after["lever.C"] == pytest.approx(before["arm.C"], abs=1e-9)


@in_browser
def test_a_file_that_cannot_be_drawn_is_named_when_the_editor_opens(drawing):
    page = drawing("slider-crank-loops")
    assert said(page) == "slider-crank-loops.toml: no links that the editor draws"
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
    for words, message in (
        (["bennett"], "planar"),
        ([str(large)], "200 kB"),
        ([str(broken)], "broken.toml"),
        (["four-bar-crank-rockr"], "did you mean"),
        (["--lang", "fr"], "en, ru"),
        (["--out", str(tmp_path / "no" / "x.html")], "no such folder"),
    ):
        code, _, err = run(capsys, "edit", *words, *([] if "--out" in words else ["--out", out]))
        assert code == 2, words
        assert message in err


def test_the_page_is_small():
    assert len(str(editor("geared-five-bar").html)) < 200_000


@in_browser
def test_what_is_deleted_while_it_is_dragged_is_let_go(drawing):
    """And a rack of a wheel as large as the Earth's orbit is drawn."""
    page = drawing()
    draw(page, drawn.RACK)
    page.locator("[data-tool=select]").click()
    typed(page, "rack1_radius mm", "1e11")
    assert page.locator("[data-id=joint-rack1-rack] path").count() == 2
    page.locator("#acts button").first.click()
    page.mouse.move(*at(page, 30, 40))
    page.mouse.down()
    page.mouse.move(*at(page, 40, 40), steps=2)
    page.keyboard.press("Delete")
    page.mouse.move(*at(page, 60, 40), steps=2)
    page.mouse.up()
    assert "link1" not in page.evaluate("mechdae.toml()")
