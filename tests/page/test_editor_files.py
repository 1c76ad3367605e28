"""Problem files that are opened in the editor's page: dropped, read in the browser, saved again."""

from __future__ import annotations

import json
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from mechdae.parts.page.editor import editor
from mechdae.parts.page.link import WEB
from tests.shared.browser import CHROMIUM, until
from tests.shared.node import needs_node, run_script

PROBLEMS = Path(__file__).resolve().parents[2] / "problems"
DROP = """([text, name]) => {
  const given = new DataTransfer();
  given.items.add(new File([text], name));
  document.getElementById("stage").dispatchEvent(
    new DragEvent("drop", { dataTransfer: given, bubbles: true, cancelable: true }));
}"""
KEPT = "# of the file that was opened, not drawn here:"
in_browser = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("editors")
    made = {
        name: editor(md.load(name)) for name in ("four-bar-double-rocker", "gorshkov-seven-link")
    }
    made |= {lang: editor(lang=lang) for lang in ("en", "ru")}
    return {name: page.save(folder / f"{name}.html") for name, page in made.items()}


def drop(page, text, name="dropped.toml"):
    """Drop a file; wait until the page has drawn it or said why not."""
    before = page.evaluate("mechdae.opened()")
    page.evaluate(DROP, [text, name])
    until(page, f"mechdae.opened() === {before + 1}")


def kept_in(text):
    """Return the lines of the other file that a saved one keeps."""
    lines = text.split(f"\n{KEPT}\n")[1].splitlines()
    assert all(line.startswith("# ") for line in lines)
    return [line[2:] for line in lines]


@in_browser
@pytest.mark.parametrize("name", ["four-bar-double-rocker", "gorshkov-seven-link"])
def test_a_saved_file_that_is_dropped_comes_out_with_the_same_bytes(opened, name):
    saved = opened(name).evaluate("mechdae.toml()")
    assert KEPT in saved
    page = opened("en")
    for text in (saved, saved.split(f"\n{KEPT}\n")[0]):
        drop(page, text)
        assert page.evaluate("mechdae.toml()") == text
        assert page.evaluate("mechdae.mobility()") == {"count": 1, "rank": 1, "without": []}
        assert len(page.evaluate("mechdae.values()")) > 60
    assert page.locator("#kept").inner_text() == ""
    moved = page.evaluate("mechdae.state().nodes.find((own) => !own.fixed && !own.slide)")
    box = page.locator("#diagram").bounding_box()
    x, y = page.evaluate(f"mechdae.screen([{moved['x']}, {moved['y']}])")
    page.mouse.move(box["x"] + x, box["y"] + y)
    page.mouse.down()
    page.mouse.move(box["x"] + x + 25, box["y"] + y + 25)
    page.mouse.up()
    assert page.evaluate("mechdae.toml()") != text  # typed numbers end where a point is moved
    page.keyboard.press("Control+z")
    assert page.evaluate("mechdae.toml()") == text


@in_browser
@pytest.mark.parametrize("name", ["gorshkov-seven-link", "slider-crank-friction", "jansen-leg"])
def test_a_rough_sketch_is_closed_where_python_closes_it(opened, name):
    page = opened("en")
    page.locator("input[type=file]").set_input_files(PROBLEMS / f"{name}.toml")
    until(page, "mechdae.state().nodes.length > 0")
    problem = md.load(name)
    driver = next(iter(problem.tasks.values())).all_drivers[0]
    start = problem.mechanism.sketch.get(driver.coordinate.split(".")[0], driver.from_)
    at = driver.at[:1] if driver.at else (start,)
    pose = md.solve(problem.mechanism, md.Sweep(driver=md.Driver(driver.coordinate, at=at)))
    state = page.evaluate("mechdae.state()")
    places = np.array([(own["x"], own["y"]) for own in state["nodes"]])
    for own in state["links"]:
        for point in problem.mechanism.bodies[own["name"]].points:
            apart = places - pose.points[f"{own['name']}.{point}"].position[0]
            assert np.hypot(*apart.T).min() < 1e-9
    fixed = {own["name"] for own in state["nodes"] if own["fixed"]}
    assert fixed <= set(problem.mechanism.ground.points)
    guides = [own.first_body for own in problem.mechanism.joints.values() if own.straight]
    assert sum(own["slide"] is not None for own in state["nodes"]) == guides.count("ground")
    slots = len(guides) - guides.count("ground")
    assert sum(own["slot"] is not None for own in state["nodes"]) == slots


@in_browser
def test_what_is_not_drawn_is_named_key_by_key_and_kept(opened, tmp_path):
    page, empty = opened("four-bar-double-rocker"), opened("en")
    first, said = page.evaluate("mechdae.toml()"), page.locator("#kept").inner_text()
    for name, keys in (
        ("geared-five-bar", "bodies.wheel joints.wheel_pin joints.mesh parameters.i42 tasks.turns"),
        ("slider-crank-friction", "loads.work joints.O.friction joints.O.pin_radius tasks.cycle"),
        ("chain-of-four-bars", "sizes.N repeat.loop"),
        ("balanced-four-bar", "bodies.crank.mass bodies.coupler.center bodies.rocker.inertia"),
    ):
        text = (PROBLEMS / f"{name}.toml").read_text(encoding="utf-8")
        drop(page, text, f"{name}.toml")
        names = page.locator("#kept").inner_text().split(": ", 1)[1].split(", ")
        assert set(keys.split()) <= set(names)
        out = page.evaluate("mechdae.toml()")
        assert kept_in(out) == text.splitlines()
        file = tmp_path / f"{name}.toml"
        file.write_text(out, encoding="utf-8")
        drawn = md.load(file).mechanism
        assert {joint.kind for joint in drawn.joints.values()} <= {"revolute", "prismatic"}
        assert "wheel" not in drawn.bodies
        drop(empty, out)
        assert empty.evaluate("mechdae.toml()") == out
        page.keyboard.press("Control+z")
        assert page.evaluate("mechdae.toml()") == first
        assert page.locator("#kept").inner_text() == said


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
def test_a_broken_file_is_named_and_the_drawing_stays(opened):
    page = opened("four-bar-double-rocker")
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
