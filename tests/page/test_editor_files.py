"""Problem files that are opened in the editor's page: dropped, read in the browser, saved again."""

from __future__ import annotations

import json
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.units import UNITS
from mechdae.parts.page.editor import editor
from mechdae.parts.page.link import WEB
from tests.shared.browser import CHROMIUM, until
from tests.shared.drawing import drop
from tests.shared.node import needs_node, run_script

PROBLEMS = Path(__file__).resolve().parents[2] / "problems"
in_browser = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("editors")
    made = {
        name: editor(md.load(name)) for name in ("four-bar-double-rocker", "gorshkov-seven-link")
    }
    made |= {lang: editor(lang=lang) for lang in ("en", "ru")}
    return {name: page.save(folder / f"{name}.html") for name, page in made.items()}


@pytest.mark.slow
@in_browser
def test_every_planar_file_comes_out_with_the_same_bytes(opened):
    page, count = opened("en"), 0
    for path in sorted(PROBLEMS.glob("*.toml")):
        text = path.read_text(encoding="utf-8")
        drop(page, text, path.name)
        if page.evaluate("mechdae.toml()") == text:
            count += 1
            continue
        data = tomllib.loads(text)
        reason = page.locator("#status").inner_text().removeprefix(f"{path.name}: ")
        if data.get("dimension") == 3:
            assert reason == "the editor draws planar mechanisms"
        elif "bodies" not in data:
            assert reason == "no links that the editor draws"
        elif path.stem == "car-axis":  # its points are sketched
            assert reason == "does not assemble near its sketch"
        else:
            raise AssertionError(f"{path.name}: {reason}")
    assert count >= 60


@in_browser
def test_a_moved_point_changes_its_numbers_and_nothing_else(opened):
    page = opened("four-bar-double-rocker")
    text = page.evaluate("mechdae.toml()")
    moved = page.evaluate("mechdae.state().nodes.find((own) => !own.fixed)")
    box = page.locator("#diagram").bounding_box()
    x, y = page.evaluate(f"mechdae.screen([{moved['x']}, {moved['y']}])")
    page.mouse.move(box["x"] + x, box["y"] + y)
    page.mouse.down()
    page.mouse.move(box["x"] + x + 25, box["y"] + y + 25, steps=3)
    page.mouse.up()
    other = page.evaluate("mechdae.toml()")
    changed = [(one, two) for one, two in zip(text.splitlines(), other.splitlines(), strict=True)
               if one != two]  # fmt: skip
    given, sketched = (set(tomllib.loads(text)[key]) for key in ("parameters", "sketch"))
    names = {one.split("=")[0].strip() for one, _ in changed}
    assert names & given == {"a", "b", "px", "py"}  # lengths that meet there, a point that stays
    assert names - given <= sketched
    for one, two in changed:  # what is said behind a number stays
        assert one.partition("#")[2] == two.partition("#")[2]
    page.keyboard.press("Control+z")
    assert page.evaluate("mechdae.toml()") == text


@in_browser
@pytest.mark.parametrize("name", ["gorshkov-seven-link", "slider-crank-friction", "jansen-leg"])
def test_a_rough_sketch_is_closed_where_python_closes_it(opened, name):
    page = opened("en")
    page.locator("input[accept='.toml']").set_input_files(PROBLEMS / f"{name}.toml")
    until(page, "mechdae.state().nodes.length > 0")
    problem = md.load(name)
    driver = next(iter(problem.tasks.values())).all_drivers[0]
    start = problem.mechanism.sketch.get(driver.coordinate.split(".")[0], driver.from_)
    pose = md.solve(
        problem.mechanism, md.Sweep(driver=md.Driver(driver.coordinate, at=(float(start),)))
    )
    points = page.evaluate("mechdae.pose().points")
    for reference, series in pose.points.items():
        assert np.abs(series.position[0] - points[reference]).max() < 1e-9
    fixed = {own["name"] for own in page.evaluate("mechdae.state().nodes") if own["fixed"]}
    assert fixed == set(problem.mechanism.ground.points)


@in_browser
def test_what_is_not_drawn_is_named_and_stays_in_the_file(opened, tmp_path):
    page = opened("four-bar-double-rocker")
    first = page.evaluate("mechdae.toml()")
    for name, names in (
        ("geared-five-bar", ""),
        ("slider-crank-friction", ""),
        ("scotch-yoke", ""),
        ("cam-roller-follower", ""),
        ("wankel-rotor", "sizes.N, repeat.seals"),
    ):
        text = (PROBLEMS / f"{name}.toml").read_text(encoding="utf-8")
        drop(page, text, f"{name}.toml")
        assert page.locator("#kept").text_content().partition(": ")[2] == names
        assert page.evaluate("mechdae.toml()") == text
        page.keyboard.press("Control+z")
        assert page.evaluate("mechdae.toml()") == first


@in_browser
def test_what_tasks_and_loads_say_stays_when_a_link_is_added(opened, tmp_path):
    page = opened("en")
    text = (PROBLEMS / "slider-crank-friction.toml").read_text(encoding="utf-8")
    drop(page, text, "a.toml")
    before = tomllib.loads(text)
    page.locator("[data-tool=link]").click()
    box = page.locator("#diagram").bounding_box()
    for x, y in ((30, 40), (70, 60)):
        page.mouse.click(box["x"] + x, box["y"] + y)
    after = tomllib.loads(page.evaluate("mechdae.toml()"))
    assert after["bodies"].pop("link1")
    assert len(after["parameters"]) == len(before["parameters"]) + 1
    for key in ("title", "ground", "bodies", "joints", "loads", "tasks", "expected"):
        assert after[key] == before[key]
    comments = [line for line in text.splitlines() if line.startswith("#")]
    assert [
        line for line in page.evaluate("mechdae.toml()").splitlines() if line[:1] == "#"
    ] == comments


WINDOW = """
[tasks.window]                   # as far as it goes
kind   = "sweep"
driver = { coordinate = "crank.angle", from_deg = 5, to_deg = 50, speed_rpm = 90 }  # slowly
poses  = 91                      # every half degree
"""


@in_browser
def test_loads_and_drivers_leave_tasks_and_units_of_the_file(opened):
    """A force adds its task; another driver has one of its own; speeds are shown as written."""
    page = opened("en")
    text = (PROBLEMS / "four-bar-crank-rocker.toml").read_text(encoding="utf-8")
    text = text.replace('speed = "omega"', "speed_rpm = 90") + WINDOW
    drop(page, text, "a.toml")
    before = tomllib.loads(text)
    speed = page.locator("#properties input[aria-label='speed [rpm]']")
    assert speed.input_value() == "90"
    page.locator("#tab-plans").click()
    page.locator("#tab-properties").click()

    def pressed(tool, x, y):
        page.locator(f"[data-tool={tool}]").click()
        box = page.locator("#diagram").bounding_box()
        u, v = page.evaluate(f"mechdae.screen([{x}, {y}])")
        page.mouse.click(box["x"] + u, box["y"] + v)

    places = page.evaluate("mechdae.pose().points")
    pressed("force", *places["coupler.C"])
    after = tomllib.loads(page.evaluate("mechdae.toml()"))
    assert after["loads"]["force1"]["kind"] == "force"
    assert after["tasks"].pop("forces")["driver"]["speed_rpm"] == 90
    assert after["tasks"] == before["tasks"]
    middle = [(a + b) / 2 for a, b in zip(places["rocker.C"], places["rocker.D"], strict=True)]
    pressed("driver", *middle)
    assert page.evaluate("mechdae.state().drivers") == ["crank.angle", "rocker.angle"]
    one, *two = WINDOW.partition("driver = ")
    one, two = (
        one + "drivers = [\n  { coordinate",
        two[1].partition(" }")[0].partition("{ coordinate")[2],
    )
    assert one + two + ' },\n  { coordinate = "rocker.angle", from_deg = ' in page.evaluate(
        "mechdae.toml()"
    )
    assert "]  # slowly\nposes  = 91                      # every half degree\n" in page.evaluate(
        "mechdae.toml()"
    )
    assert "too many drivers" in page.locator("#status").inner_text()
    middle = [(a + b) / 2 for a, b in zip(places["crank.A"], places["crank.B"], strict=True)]
    pressed("driver", *middle)
    assert page.evaluate("mechdae.state().drivers") == ["rocker.angle"]
    after = tomllib.loads(page.evaluate("mechdae.toml()"))["tasks"]
    assert after["turn"] == before["tasks"]["turn"]
    assert after["modes"]["driver"]["coordinate"] == "rocker.angle"
    assert "\n[tasks.modes]                    # open and crossed\n" in page.evaluate(
        "mechdae.toml()"
    )


@in_browser
def test_what_names_a_deleted_link_goes_with_it(opened, tmp_path):
    """A load on a joint, tasks, expected values: what is saved can be read."""
    page = opened("en")
    text = (PROBLEMS / "quick-return-pin.toml").read_text(encoding="utf-8")
    drop(page, text, "a.toml")
    x, y = page.evaluate("mechdae.screen(mechdae.pose().points['rod.G'])")
    box = page.locator("#diagram").bounding_box()
    page.locator("[data-tool=delete]").click()
    page.mouse.click(box["x"] + x, box["y"] + y)
    file = tmp_path / "left.toml"
    file.write_text(page.evaluate("mechdae.toml()"), encoding="utf-8")
    assert "G.angle" in text
    problem = md.load(file)
    assert list(problem.mechanism.bodies) == ["crank"]
    assert not problem.mechanism.loads
    assert not any("/G/" in own.what or "slot" in own.what for own in problem.expected)
    page.keyboard.press("Control+z")
    assert page.evaluate("mechdae.toml()") == text


BROKEN = {
    "schema = 1\n\n[bodies.crank\n": "bad.toml, line 3: a key is needed",
    "a = 1\na = 2\n": "bad.toml, line 2: given twice: a",
    "a = 1979-05-27\n": "bad.toml, line 1: not a value that is known here",
    'a = """\n"""\n': "bad.toml, line 1: strings over several lines are not known here",
    'a = "x\n': "bad.toml, line 1: not a string",
    "a = " + "[" * 5000: "bad.toml, line 1: not a value that is known here",
    "\0\1\2": "bad.toml, line 1: a key is needed",
    "dimension = 3\n": "bad.toml: the editor draws planar mechanisms",
    "": "bad.toml: no links that the editor draws",
    "x = 1 #" + "x" * 200_000: "bad.toml: larger than 200 kB",
    '[bodies.k]\npoints = { A = [0, 0], B = ["1/0", 0] }\n':
        "bad.toml: not a number: bodies.k.points.B: 1/0",
    '[parameters]\na = "b"\nb = "a"\n[bodies.k]\npoints = { A = [0, 0], B = ["a", 0] }\n':
        "bad.toml: not a number: bodies.k.points.B: a",
    '[bodies."a b"]\npoints = { A = [0, 0], B = [1, 0] }\n':
        "bad.toml: not a name that the editor can draw: bodies.a b",
    "[ground]\npoints = { O = [0, 0], D = [9, 0] }\n"
    "[bodies.k]\npoints = { A = [0, 0], B = [1, 0] }\n"
    '[joints]\nO.kind = "revolute"\nO.between = ["ground.O", "k.A"]\nD.kind = "revolute"\n'
    'D.between = ["ground.D", "k.B"]\n': "bad.toml: does not assemble near its sketch",
}  # fmt: skip


@in_browser
@pytest.mark.parametrize(
    ("shape", "live"),
    [
        ("1 + 0.02*cos(3*s)", True),
        ("1 + 0.3*exp(-20000*(1 - cos(s - 1.67)))", False),
        ("1 + 0.02*cos(200*s)", False),
    ],
    ids=["smooth", "a narrow bump", "a fine ripple"],
)
def test_a_cam_is_solved_only_as_the_curve_that_it_is(opened, shape, live):
    """A bump between the places at which a curve is read, and a ripple that looks like another."""
    page = opened("en")
    text = (PROBLEMS / "cam-roller-follower.toml").read_text(encoding="utf-8")
    for axis in ("cos(s)", "sin(s)"):
        text = text.replace(f'/8)*{axis}"', f'/8)*({shape})*{axis}"')
    assert shape in text
    drop(page, text, "cam.toml")
    assert page.evaluate("mechdae.toml()") == text
    assert page.evaluate("mechdae.live") is live
    assert ("only mechdae itself solves" in page.locator("#status").inner_text()) is not live


@in_browser
def test_a_broken_file_is_named_and_the_drawing_stays(opened):
    page = opened("four-bar-double-rocker")
    page.evaluate("mechdae.set(mechdae.values()[5])")
    before = page.evaluate("[mechdae.toml(), mechdae.state()]")
    for text, said in BROKEN.items():
        drop(page, text, "bad.toml")
        assert page.locator("#status").inner_text() == said
        assert page.evaluate("[mechdae.toml(), mechdae.state()]") == before
    page.keyboard.press("Control+z")
    assert page.evaluate("mechdae.state()") == before[1]
    page = opened("ru")
    drop(page, "a = 1\na = 2\n", "bad.toml")
    assert page.locator("#status").inner_text() == "bad.toml, строка 2: дано дважды: a"


@needs_node
def test_tables_and_expressions_are_those_that_python_reads(tmp_path):
    files = sorted(PROBLEMS.glob("*.toml"))
    more = (
        "a.'b c'.\"d\\u0041\" = [1, [2.5e-3, -7],\n # note\n true, ]\n"
        "[[t.u]]\nx = +1_000\n[[t.u]]\n[t.u.v]\ny = 'a\\b'\n",
        's = "#, = [ \\" \\\\ \\t é"\r\n[a]\r\n[a.b]\r\n',
    )
    texts = [file.read_text(encoding="utf-8") for file in files] + list(more)
    sums = {
        "-2**2 + 3*(4 - 1)/2": -4 + 4.5,
        "2**-1**2": 0.5,
        "2**3**2": 512.0,
        "sqrt(l**2 - r*r)*sin(pi/6) - -r": math.sqrt(8.0) * math.sin(math.pi / 6) + 1,
        "atan2(r, -l) + hypot(r, l) + min(3, r, l) + 1.5e-3*l": math.atan2(1, -3)
        + math.sqrt(10)
        + 1
        + 0.0045,
    }
    wrong = [
        "",
        "1 +",
        "2 3",
        "alert(1)",
        "x",
        "constructor",
        "sin(1, 2)",
        "1/0",
        "(1",
        "r;",
        "a.b",
    ]
    found = run_script(
        f"import {{ readToml }} from {json.dumps((WEB / 'read_toml.js').as_uri())};\n"
        f"import {{ calculated }} from {json.dumps((WEB / 'arithmetic.js').as_uri())};\n"
        f"const texts = {json.dumps(texts)}, wrong = {json.dumps(wrong)};\n"
        "const of = (text) => calculated(text, (name) => ({ r: 1, l: 3 })[name] ?? NaN);\n"
        "const no = (text) => { try { of(text); return false; } catch (e) { return e.word; } };\n"
        f"const sums = {json.dumps(list(sums))}.map(of);\n"
        "console.log(JSON.stringify([texts.map(readToml), sums, wrong.map(no)]));",
        tmp_path,
    )  # fmt: skip
    assert found[0] == [tomllib.loads(text) for text in texts]
    assert found[1] == pytest.approx(list(sums.values()), rel=1e-14)
    assert found[2] == ["no_number"] * len(wrong)


@needs_node
def test_a_length_that_cannot_close_is_refused_without_trying_the_same_again(tmp_path):
    path = PROBLEMS / "toggle-press.toml"
    units = {u.suffix: [u.size.numerator, u.size.denominator, u.pi] for u in UNITS.values()}
    refused, changed, tries = run_script(
        f"import {{ Sketch }} from {json.dumps((WEB / 'edit/sketch.js').as_uri())};\n"
        f"import {{ Rows }} from {json.dumps((WEB / 'edit/rows.js').as_uri())};\n"
        f"const text = {json.dumps(path.read_text(encoding='utf-8'))};\n"
        f"const sketch = new Sketch(text, {json.dumps(units)}), {{ followed }} = Rows.prototype;\n"
        "let tries = 0, refused = '';\n"
        "Rows.prototype.followed = function (q) { tries += 1; return followed.call(this, q); };\n"
        "const [side] = sketch.lengths(sketch.links[0].name);\n"
        "const long = () => sketch.resize(side, 9);\n"
        "try { sketch.change(long, { strict: true }); } catch (error) { refused = error.word; }\n"
        "const [from, to] = [/(points *= *\\{ )/g, '$1Z = [0, 0], '];\n"
        f"const twice = new Sketch(text.replace(from, to), {json.dumps(units)});\n"
        "const other = twice.lengths(twice.links[1].name).find(({ value }) => value > 0);\n"
        "twice.change(() => twice.resize(other, 1.01 * other.value), { strict: true });\n"
        "const changed = [sketch.text === text, twice.text.includes('Z = [0, 0]'), twice.flat];\n"
        "console.log(JSON.stringify([refused, changed, tries]));",
        tmp_path,
    )  # fmt: skip
    assert refused == "does_not_close"
    assert changed[:2] == [True, True]
    assert changed[2] > 0  # points of a file that coincide forbid no change of another length
    assert tries <= 8
