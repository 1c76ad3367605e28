"""What is reported of a design is what its own file does: in the sense and order asked for."""

from __future__ import annotations

import ast
import tomllib
from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.describe.tasks.goals import FunctionTargets
from mechdae.errors import InputError
from tests.attack.planted_designs import KINDS, wrong
from tests.reference.closure_fourbar import rrp, rrr
from tests.shared.paths import DATA, ROOT

CASE = DATA / "synthesis" / "rocker-mirrored.toml"
GROUND = 4.0


@pytest.mark.parametrize("kind", KINDS)
def test_designs_that_do_something_else_are_seen(kind):
    """Sound ones are not; `python -m tests.attack.planted_designs` draws 300 of each."""
    planted, bad = wrong(kind, 6)
    assert not bad
    assert len(planted) >= 4
    assert all(planted.values())


def test_verification_has_no_code_of_goals():
    folder = ROOT / "mechdae" / "design" / "synthesis" / "verification"
    modules = {"claims", "design_file", "quantities", "verify"}
    files = [*folder.glob("*.py"), ROOT / "mechdae" / "parts" / "types" / "schemes" / "verified.py"]
    assert {path.stem for path in files} == {*modules, "__init__", "verified"}
    allowed = ("describe", "design.derivatives.figures", "errors", "motion.kinematics.sweep",
               "records", "results", "tasks.dispatch", "types", "design.studies",
               "design.synthesis.verification",
               "design.synthesis.robust", "design.synthesis.quantity",
               "parts.types.described")  # fmt: skip
    for path in files:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("mechdae."):
                assert node.module.removeprefix("mechdae.").startswith(allowed), (path, node.module)


def outputs(design, inputs):
    """Return the rocker's angle by the closed form, in the mode of the design's sketch."""
    p, text = design["parameters"], tomllib.loads(design["problem"])["sketch"]
    degrees = {n.removesuffix("_deg"): np.deg2rad(v) for n, v in text.items() if n[-4:] == "_deg"}
    sketch = text | degrees
    links = {name: p[name] * np.exp(1j * sketch[body])
             for name, body in (("a", "crank"), ("b", "coupler"), ("c", "rocker"))}  # fmt: skip
    assert abs(links["a"] + links["b"] - GROUND - links["c"]) < 1e-9
    A = p["a"] * np.exp(1j * inputs)
    line = GROUND - links["a"]
    side = np.sign((np.conj(line) * links["b"]).imag)
    B, height = rrr(A, GROUND + 0j * A, abs(p["b"]), abs(p["c"]), side)
    assert (height > 0).all()
    return np.angle((B - GROUND) / p["c"])


def gaps(found, wanted):
    return np.mod(np.asarray(found) - wanted + np.pi, 2 * np.pi) - np.pi


def test_a_rocker_that_turns_the_other_way_is_no_design():
    problem = md.load(CASE)
    x, y = np.array(problem.tasks["design"].goal.targets).T
    result = md.synthesize(problem, starts=8)
    for design in result.data["designs"]:
        errors = gaps(outputs(design, x), y)
        np.testing.assert_allclose(design["errors"], errors, atol=1e-9)
        assert design["objective"] == pytest.approx(np.mean(errors**2), rel=1e-9)
        assert design["sense"] == 1
    # 200 000 four-bars of these bounds, both modes: none is better
    d = np.random.default_rng(1).uniform([0.2, 0.01, 0.2], [6, 50, 6], (200_000, 3))
    a, b, c = (column[:, None] for column in d.T)
    best = np.inf
    for side in (1, -1):
        B, height = rrr(a * np.exp(1j * x), GROUND + 0j * x, b, c, side)
        miss = np.mean(gaps(np.angle(B - GROUND), y) ** 2, axis=1)
        best = min(best, float(miss[(height > 0).all(axis=1)].min()))
    assert result.data["designs"][0]["objective"] <= best
    assert best > 0.03


def test_a_free_sense_is_asked_for_and_told():
    text = CASE.read_text(encoding="utf-8")
    problem = from_dict(tomllib.loads(text.replace("targets =", 'sense = "free"\ntargets =')))
    x, y = np.array(problem.tasks["design"].goal.targets).T
    result = md.synthesize(problem, starts=8)
    best = result.data["designs"][0]
    assert best["sense"] == -1
    assert best["objective"] < 1e-14
    assert np.abs(gaps(outputs(best, x), 2 * y[0] - y)).max() < 1e-7
    assert "sense" in str(result)
    assert "-1" in str(result).splitlines()[2]


def test_a_slide_that_goes_the_other_way_is_no_design():
    """A slider-crank by places of its block, mirrored about the first: they only grow."""
    crank, rod = 1.2, 4.0
    x = np.radians([200.0, 230.0, 260.0, 290.0])
    B, _ = rrp(crank * np.exp(1j * x), rod, 0j, 1.0, 1)
    text = """
schema = 1
[parameters]
r = 1
l = 3
e = 0.1
[ground]
points = { O = [0, 0], G = [0, "e"] }
[bodies.crank]
points = { O = [0, 0], A = ["r", 0] }
[bodies.rod]
points = { A = [0, 0], B = ["l", 0] }
[bodies.block]
points = { B = [0, 0] }
[joints]
O = { kind = "revolute", between = ["ground.O", "crank.O"] }
A = { kind = "revolute", between = ["crank.A", "rod.A"] }
B = { kind = "revolute", between = ["rod.B", "block.B"] }
guide = { kind = "prismatic", between = ["ground.G", "block.B"] }
[sketch]
crank_deg = 200
rod_deg = 10
"guide.slide" = 2
[tasks.design]
kind = "synthesis"
driver = { coordinate = "crank.angle" }
starts = 6
free = { r = [0.2, 3], l = [0.5, 9], e = [-0.5, 0.5] }
[tasks.design.goal]
kind = "function"
output = "guide.slide"
"""
    mirrored = np.stack([x, 2 * B[0].real - B.real], axis=1).tolist()
    result = md.synthesize(from_dict(tomllib.loads(text + f"targets = {mirrored}")))
    for design in result.data["designs"]:
        p = design["parameters"]
        s = [np.sqrt(p["l"] ** 2 - (p["r"] * np.sin(x) - p["e"]) ** 2) * k for k in (1, -1)]
        slide = [p["r"] * np.cos(x) + own for own in s]
        misses = [own - np.array(mirrored)[:, 1] for own in slide]
        errors = min(misses, key=lambda own: np.abs(own - design["errors"]).max())
        np.testing.assert_allclose(design["errors"], errors, atol=1e-9)
        assert design["objective"] > 1e-4


def test_a_search_that_turns_the_output_round_is_caught(monkeypatch):
    """The slip itself: a search that tries both senses where one is asked for."""
    monkeypatch.setattr(FunctionTargets, "senses", (1, -1))
    result = md.synthesize(md.load(CASE), starts=8)
    caught = [reason for own in result.summary["rejected"] for reason in own["reasons"]]
    assert any(reason.startswith("the sweep gives") for reason in caught)
    assert all(design["objective"] > 0.03 for design in result.data["designs"])


@pytest.mark.parametrize("sense", ["given", "free"])
def test_the_sense_of_a_formula(sense):
    """An output range below zero turns the output the other way; a free sense may, too."""
    problem = md.load("fg4-exp-0-1-90-90")
    task = problem.tasks["design"]
    changed = replace(task.goal, sense=sense, output_range=-task.goal.output_range)
    whole = problem.with_task("design", replace(task, goal=changed))
    best = md.synthesize(whole, "design", starts=2).data["designs"][0]
    begin, end = (best["parameters"][name] for name in ("phi0", "psi0"))
    share = np.linspace(0, 1, 721)
    y = -np.pi / 2 * best["sense"] * (np.exp(share) - 1) / (np.e - 1)
    p = best["parameters"]
    misses = []
    for side in (1, -1):
        A = p["a"] * np.exp(1j * (begin + np.pi / 2 * share))
        B, _ = rrr(A, 1 + 0j * A, p["b"], p["c"], side)
        misses.append(np.abs(gaps(np.angle(B - 1), end + y)).max())
    assert min(misses) == pytest.approx(best["objective"], rel=1e-4)
    assert sense == "free" or best["sense"] == 1


@pytest.mark.parametrize("word", ["turned", 1])
def test_senses_that_do_not_exist(word):
    text = CASE.read_text(encoding="utf-8").replace("targets =", f"sense = {word!r}\ntargets =")
    with pytest.raises((InputError, md.MechdaeError)) as caught:
        md.synthesize(from_dict(tomllib.loads(text)))
    assert "sense" in str(caught.value)
