"""Paths by targets, functions, and sliding pairs in compositions: closed without the package.

Each design's file is followed in absolute coordinates by Newton's method in 80 bits.
"""

from __future__ import annotations

import json
import tomllib

import numpy as np
import pytest

import mechdae as md
from mechdae.describe.file.load import from_dict
from mechdae.errors import MechdaeError
from mechdae.parts.types.schemes.aims import Aim
from mechdae.parts.types.schemes.closure import material, turned
from mechdae.parts.types.schemes.designs import loss_of, problem_of_scheme
from mechdae.parts.types.schemes.losses import LossAsked, loss_slopes, losses
from mechdae.parts.types.schemes.placed_design import PlacedDesign
from mechdae.parts.types.schemes.scheme import read
from mechdae.parts.types.schemes.screening import drawn
from mechdae.parts.types.schemes.targets.visits import FunctionFitting, VisitFitting, assigned
from mechdae.parts.types.schemes.types import schemes_of
from mechdae.results.tables import table
from tests.shared.paths import DOCS
from tests.shared.scheme_goals import (
    CLOSED,
    ELLIPSE,
    composition,
    designs,
    moved,
    output_of,
    place_of,
)

TURN = 2 * np.pi
STEPS = [20.0 * k for k in range(18)]
BOTH = ["R", "P"]


def root_mean(gaps, weights=None):
    squares = np.sum(np.reshape(gaps, (len(gaps), -1)) ** 2, axis=1)
    return np.sqrt(np.average(squares, weights=weights))


def checked_file(design):
    """Return the closed poses at the targets; what `solve` gives of the file is within 1e-12."""
    data = tomllib.loads(design["problem"])
    problem = from_dict(data, "design")
    closure, q = moved(design["problem"], design["input"])
    found = md.solve(problem, "targets")
    assert {str(word) for word in found.status} == {"ok"}
    for body in data["bodies"]:
        own = q[:, closure.column[body] + 2].astype(float)
        gap = found.bodies[body].angle - own
        assert np.abs(gap - TURN * np.round(gap / TURN)).max() < 1e-12, body
    path = md.solve(problem, "path")
    assert {str(word) for word in path.status} == {"ok"}
    assert not path.summary.get("limits")
    return closure, q, data


def on_page(name, number, digits, unit) -> None:
    """Compare a number of the table of the page."""
    rows = (DOCS / "theory/evidence/compositions.md").read_text(encoding="utf-8").splitlines()
    row = next(line for line in rows if line.startswith(f"| {name}"))
    assert f"{number:.{digits}g}{unit}" in row.split("|")[3]


def test_timed_targets_with_turning_and_sliding_pairs() -> None:
    """The four-bar is that of the literature and the best known one; a slider-crank is lighter."""
    goal = {"kind": "path", "closed": True, "steps_deg": STEPS, "targets": CLOSED}
    found = designs(goal, pairs=BOTH)
    # least sum of squares known of the case of 18 points: 9.0298e-3 m2, by many-start least squares
    assert found[0]["error"] <= np.sqrt(9.0298e-3 / 18)
    on_page("eighteen places", found[0]["error"], 5, " m")
    assert any(" S" in own["scheme"] or " T" in own["scheme"] for own in found)
    for own in found:
        closure, q, _ = checked_file(own)
        gaps = place_of(closure, q, own["traced"]) - np.array(CLOSED)
        assert own["error"] == pytest.approx(root_mean(gaps), rel=1e-9)
        assert np.allclose(own["values"], place_of(closure, q, own["traced"]), atol=1e-12)


def test_targets_in_order() -> None:
    found = designs({"kind": "path", "closed": True, "targets": ELLIPSE}, keep=2)
    weights = [2.0, *[1.0] * 8]
    # f = 4.0204e-4 m2 with weight 2 on the first of ten, from the same reference
    assert found[0]["error"] <= np.sqrt(4.0204e-4 / 10)
    on_page("nine places", found[0]["error"], 5, " m")
    for own in found:
        closure, q, _ = checked_file(own)
        gaps = place_of(closure, q, own["traced"]) - np.array(ELLIPSE[:-1])
        assert own["error"] == pytest.approx(root_mean(gaps, weights), rel=1e-9)
        steps = np.diff(own["input"])
        assert (steps > 0).all() or (steps < 0).all()
        assert abs(own["input"][-1] - own["input"][0]) < TURN


NINE = [
    [0.25, 0], [0.52, 0.1], [0.8, 0.7], [1.2, 1], [1.4, 1.3], [1.1, 1.48], [0.7, 1.4], [0.2, 1],
    [0.02, 0.4],
]  # fmt: skip
"""Problem 3 of Wampler, Morgan and Sommese (1992): one of its four-bars moves without fault."""


def test_nine_points_lead_to_the_one_four_bar_that_moves_well() -> None:
    goal = {"kind": "path", "closed": True, "targets": NINE}
    changes = {"objectives": ["error", "joints"], "samples": 3000, "starts": 24, "seed": 1}
    (best,) = designs(goal, **changes)
    assert best["error"] < 1e-12
    # problem 3 of Wampler, Morgan and Sommese 1992: one of 64 real four-bars moves, 12.06 degrees
    assert np.degrees(best["transmission_angle_min"]) == pytest.approx(12.06, abs=0.005)


def test_a_function_of_an_angle() -> None:
    """Least largest error of a sine over 90 degrees: 0.193182 degrees, same reference."""
    goal = {
        "kind": "function", "function": "sin(x)", "range_deg": [0, 90], "input_range_deg": 90,
        "output_range_deg": 90, "input_start_deg": 30, "output_start_deg": -20,
        "measure": "minimax",
    }  # fmt: skip
    found = designs(goal, keep=2)
    assert found[0]["error"] <= np.radians(0.193182) * 1.001
    on_page("sine", np.degrees(found[0]["error"]), 5, "°")
    x = np.linspace(0, np.pi / 2, 41)
    for own in found:
        closure, q, data = checked_file(own)
        assert np.allclose(own["input"], np.pi / 6 + x, atol=1e-12)
        output = output_of(closure, q, own["output"], data)
        wanted = -np.pi / 9 + np.pi / 2 * np.sin(x)
        gaps = output - wanted
        gaps -= TURN * np.round(gaps / TURN)
        assert own["error"] == pytest.approx(np.abs(gaps).max(), rel=1e-9)


def test_a_planted_slider_crank_comes_back() -> None:
    """The slide of an offset slider-crank by its closed form, over 200 degrees."""
    crank, bar, offset = 0.1, 0.32, 0.03
    phi = np.radians(np.linspace(20, 220, 15))
    slide = crank * np.cos(phi) + np.sqrt(bar**2 - (crank * np.sin(phi) - offset) ** 2)
    targets = np.stack([phi, slide], axis=1).tolist()
    goal = {"kind": "function", "output": "slide", "targets": targets}
    found = designs(goal, pairs=BOTH, objectives=["error", "joints"])
    best = found[0]
    assert best["error"] < 1e-9
    assert best["joints"] == 4
    closure, q, data = checked_file(best)
    assert np.abs(output_of(closure, q, best["output"], data) - slide).max() < 1e-8
    spots = {name: complex(*spot) for name, spot in best["places"].items()}
    _, own_crank, own_bar, _ = best["link_points"]
    assert abs(spots[own_crank[1]] - spots[own_crank[0]]) == pytest.approx(crank, rel=1e-4)
    assert abs(spots[own_bar[1]] - spots[own_bar[0]]) == pytest.approx(bar, rel=1e-4)


def test_a_planted_swinging_block_comes_back() -> None:
    """A point of a rod that slides through a block on the frame: its closed form, timed."""
    crank, pivot, arm = 1.0, 2.6 + 0.4j, 1.4 + 0.8j
    phi = TURN * np.arange(16) / 16
    pin = crank * np.exp(1j * phi)
    along = (pivot - pin) / np.abs(pivot - pin)
    traced = pin + arm * along
    targets = np.stack([traced.real, traced.imag], axis=1).tolist()
    goal = {"kind": "path", "closed": True, "steps": phi.tolist(), "targets": targets}
    found = designs(goal, pairs=BOTH, objectives=["error", "joints"], samples=1000)
    rods = [own for own in found if " T" in own["scheme"]]
    assert rods
    assert min(own["error"] for own in rods) < 1e-7
    checked_file(found[0])


SLIDING = [
    "F C F S1.2 R1.3 *4", "F C F T1.2 R1.3 *4", "F C F T2.1 D1.3 R1.4 *5",
    "F C F D1.2 R1.3 R1.3 F T5.4 S6.0 *7", "F C R0.1 F D1.3 S4.2 R4.5 *6",
]  # fmt: skip


@pytest.mark.parametrize("text", SLIDING)
def test_derivatives_with_slides_are_those_of_differences(text) -> None:
    scheme, generator = read(text), np.random.default_rng(3)
    angles, h, checked = np.linspace(-0.2, 0.2, 7), 1e-6, 0
    for _ in range(400):
        spots = generator.normal(0, 2, (2, scheme.size))
        places = (spots[0] + 1j * spots[1])[None]
        places[0, :2] = 0.0, 0.3
        turn = turned(scheme, places, angles, derivatives=True, by_angle=True)
        if not (turn.least[0] > 0.3 and np.isfinite(turn.x).all()):
            continue
        assert np.abs(turn.x[:, 0, 3] - places[0]).max() < 1e-12
        _, slopes = material(scheme, places, slopes=True, turn=turn)
        count = 2 * (scheme.size - 1)
        for column in range(count + 1):
            ends = []
            for sign in (1, -1):
                own, at = places.copy(), angles.copy()
                if column < count:
                    own[0, 1 + column // 2] += sign * h * (1j if column % 2 else 1.0)
                else:
                    at = at + sign * h
                found = turned(scheme, own, at)
                ends.append((found, material(scheme, own, turn=found)[0]))
            (one, more), (other, less) = ends
            for k in range(scheme.size):
                rate = (one.x[k, 0] - other.x[k, 0]) / (2 * h)
                own = np.broadcast_to(turn.every[k], (1, 7, count + 1))[0, :, column]
                assert np.abs(rate - own).max() < 1e-7 * (1 + np.abs(rate).max())
            for k, (at, slope) in turn.slopes.items():
                rate = (one.sines[k][0, at[0]] - other.sines[k][0, at[0]]) / (2 * h)
                assert abs(rate - slope[0, column]) < 1e-7
            if column < count:
                assert abs((more - less) / (2 * h) - slopes[0, column]) < 1e-6
        checked += 1
        if checked == 3:
            return
    raise AssertionError("no sets that assemble")


PLACES = np.array([[0, 1, 2.4 + 0.3j, 1.9 + 2.1j, 0.6 + 2.2j], [0, 0.9, 2.5, 2 + 2j, 1 + 2.5j]])


def fittings():
    target = np.exp(1j * np.linspace(0.1, 3.0, 7))
    weights = (1 / 7,) * 7
    timed = Aim("path", targets=tuple(target), angles=tuple(np.linspace(0, 2, 7)), weights=weights)
    free = Aim("path", targets=tuple(target), weights=weights)
    four = read("F C F D1.2 R1.3 *4")
    yield VisitFitting(four, PLACES, timed, [9.0, 99.0], [0.1, 0.1])
    yield VisitFitting(four, PLACES, free, [9.0, 99.0], [0.1, 0.1])
    least = Aim(
        "angle", targets=tuple(np.linspace(0, 1, 7) ** 2), angles=tuple(np.linspace(0, 1, 7)),
        weights=weights, span=(0.0, 1.0), minimax=True,
    )  # fmt: skip
    yield FunctionFitting(read("F C F D1.2 *3"), PLACES[:, :4], least, [9.0, 99.0], [0.1, 0.1])


@pytest.mark.parametrize("number", range(3))
def test_gradients_of_fittings_are_those_of_differences(number) -> None:
    """Of squares with limits, at powers 2 and 4 of the errors, by all unknowns."""
    fitting = list(fittings())[number]
    state = fitting._begun(None)
    for _ in range(2):
        _, slope = fitting._normal(state)
        for column in range(slope.shape[1]):
            step = np.zeros(slope.shape)
            step[:, column] = 1e-6
            one, other = fitting._stepped(state, step), fitting._stepped(state, -step)
            rate = (one.merit - other.merit) / 2e-6
            if number == 2 and column in (2, 3):
                assert (slope[:, column] == 0).all()  # the pivot of the output stays
            else:
                assert np.allclose(rate, 2 * slope[:, column], rtol=1e-4, atol=1e-7), column
        state = fitting._begun(state)


def test_assignments_in_order_are_the_best_ones() -> None:
    """Compared with all choices of four places out of nine, both senses."""
    from itertools import combinations

    generator = np.random.default_rng(5)
    curves = generator.normal(size=(6, 9)) + 1j * generator.normal(size=(6, 9))
    target = generator.normal(size=4) + 1j * generator.normal(size=4)
    weights = np.array([0.4, 0.2, 0.2, 0.2])
    aim = Aim("path", targets=tuple(target), weights=tuple(weights))
    places, senses = assigned(curves, aim)
    for row in range(6):
        best = np.inf
        for sense in (1, -1):
            for first in range(9):
                for rest in combinations(range(1, 9), 3):
                    at = (first + sense * np.array([0, *rest])) % 9
                    best = min(best, (weights * np.abs(curves[row, at] - target) ** 2).sum())
        own = curves[row, places[row] % 9]
        assert (weights * np.abs(own - target) ** 2).sum() == pytest.approx(best, rel=1e-12)
        assert (np.diff(senses[row] * places[row]) > 0).all()


def test_schemes_with_slides_of_four_links_by_hand() -> None:
    """Slider-crank, rods through a block on the frame; what turns or slides on the frame."""
    curve = {own.text for own in schemes_of(4, 1, "curve", True)}
    assert curve == {
        "F C F D1.2 R1.3 *4", "F C F S1.2 R1.3 *4", "F C F T1.2 R1.3 *4", "F C F T1.2 *3",
    }  # fmt: skip
    angle = {own.text for own in schemes_of(4, 1, "angle", True)}
    assert angle == {"F C F D1.2 *3", "F C F T1.2 *3", "F C F T2.1 *3"}
    assert {own.text for own in schemes_of(4, 1, "slide", True)} == {"F C F S1.2 *3"}
    six = [own for place in (1, 2) for own in schemes_of(6, place, "path", True)]
    eight = [own for place in range(1, 17) for own in schemes_of(8, place, "path", True)]
    page = (DOCS / "how-to/schemes.md").read_text(encoding="utf-8")
    assert f"of six {len(six)}, of eight {len(eight)}, in place of 1, 11 and 124" in page
    for own in six:
        assert len(own.links) == 6
        assert own.joints == 7


RUB = LossAsked(1e-4, 0.02, (30.0, -50.0))
RESIST = LossAsked(1e-4, 0.02, (30.0,))
LOADED = [
    ("F C F D1.2 R1.3 *4", Aim("curve"), RUB), ("F C F S1.2 R1.3 *4", Aim("curve"), RUB),
    ("F C F T1.2 R1.3 *4", Aim("curve"), RUB),
    ("F C F D1.2 R1.3 R1.3 R1.3 F D4.7 S8.6 *9", Aim("curve"), RUB),
    ("F C F D1.2 *3", Aim("angle"), RESIST),
]  # fmt: skip


@pytest.mark.parametrize(("text", "aim", "rubbing"), LOADED)
def test_losses_are_those_of_the_ordinary_model_to_first_order(text, aim, rubbing) -> None:
    scheme, generator = read(text), np.random.default_rng(1)
    x = drawn(scheme, 1, TURN * np.arange(64) / 64, generator)
    places = x[:, :, 0].T.copy()
    kind, i, j = scheme.points[scheme.trace]
    if kind == "R":
        share = 0.5 + 0.3j
        places[:, scheme.trace] = places[:, i] + share * (places[:, j] - places[:, i])
    own = losses(scheme, places, aim, rubbing, 360)
    problem = problem_of_scheme(scheme, PlacedDesign(places[0], {}, {}), "x", "", rubbing, aim)
    assert own[0] == pytest.approx(loss_of(problem), rel=3e-4)
    slopes, h = loss_slopes(scheme, places, aim, rubbing), 3e-5
    for column in range(slopes.shape[1]):
        ends = []
        for sign in (1, -1):
            moved_places = places.copy()
            moved_places[0, 1 + column // 2] += sign * h * (1j if column % 2 else 1.0)
            ends.append(losses(scheme, moved_places, aim, rubbing)[0])
        assert (ends[0] - ends[1]) / (2 * h) == pytest.approx(
            slopes[0, column], rel=1e-3, abs=1e-3 * np.abs(slopes).max()
        )


def test_a_front_of_error_and_loss() -> None:
    """Less loss for more error; each loss is that of the file, solved with friction."""
    goal = {"kind": "path", "closed": True, "steps_deg": STEPS, "targets": CLOSED}
    found = designs(
        goal, objectives=["error", "loss"], reference=[0.2, 1.0], friction=0.1, pin_radius=0.01,
        load=[0, -50], keep=5,
    )  # fmt: skip
    values = np.array([own["objectives"] for own in found])
    assert len(found) >= 4
    assert (np.diff(values[:, 1]) < 0).all()
    # the same curve has cognates, one of which loses less
    assert values[0, 0] <= np.sqrt(9.0298e-3 / 18)
    assert values[-1, 1] < 0.8 * values[0, 1]
    for own in found[::2]:
        problem = from_dict(tomllib.loads(own["problem"]), "design")
        solved = md.solve(problem, "loss")
        assert own["loss"] == pytest.approx(solved.summary["loss"], rel=1e-12)
        # a constant force does no work over a turn: all that goes in is lost
        assert solved.summary["input"] == pytest.approx(own["loss"], rel=1e-3)


SHORT = {"samples": 60, "starts": 2, "grow": 1, "points": 7, "keep": 3}
FUNCTION = {
    "kind": "function", "function": "x**2", "range": [0, 1], "input_range_deg": 60,
    "output_range_deg": 60,
}  # fmt: skip


def test_growth_workers_and_a_broken_job_give_the_same_bits(tmp_path) -> None:
    problem = composition(FUNCTION, pairs=BOTH, **SHORT)
    alone = md.synthesize(problem, "t", out=tmp_path / "job")
    assert alone.data["designs"]
    log = tmp_path / "job" / "pieces.jsonl"
    lines = log.read_bytes().splitlines(keepends=True)
    log.write_bytes(b"".join(lines[:3]) + lines[3][:30])
    again = md.synthesize(problem, "t", out=tmp_path / "job")
    spread = md.synthesize(problem, "t", workers=2)
    for other in (again, spread):
        assert json.dumps(other.data["designs"]) == json.dumps(alone.data["designs"])
    assert "error [deg]" in table(alone)
    drawn = md.plot(alone, "sheet")
    texts = [own.get_text() for own in drawn.texts]
    assert any(text.startswith("1   error") and text.count("deg") == 1 for text in texts)
    sizes = {round_["round"] for round_ in alone.summary["rounds"]}
    assert "growth 1" in sizes


WRONG = [
    ({"kind": "path", "targets": [[0, 0], [1, 1]]}, {}, "goal.targets", "3 different points"),
    ({"kind": "path", "targets": CLOSED, "point": "link.P"}, {}, "goal.point", "chooses"),
    ({"kind": "path", "targets": CLOSED, "measure": "exact"}, {}, "goal.measure", "not zero"),
    ({"kind": "path", "targets": CLOSED, "weight": 2}, {}, "goal.weight", "one goal"),
    ({"kind": "path", "targets": CLOSED, "steps": [0, 1]}, {}, "goal.steps", "2 values"),
    (
        {"kind": "path", "targets": CLOSED, "steps": [k * 1.0 for k in range(18)]},
        {},
        "goal.steps",
        "974",
    ),
    ({"kind": "path", "targets": CLOSED, "steps": [0.0] * 18}, {}, "goal.steps", "stands still"),
    ({**FUNCTION, "input": "rocker.angle"}, {}, "goal.input", "crank"),
    ({**FUNCTION, "output": "link3.angle"}, {}, "goal.output", "angle"),
    ({**FUNCTION, "output": "slide"}, {}, "goal.output", "no slide"),
    ({**FUNCTION, "targets": [[0, 0], [1, 1], [2, 2]]}, {}, "goal", "either"),
    ({"kind": "function", "targets": [[0, 1], [1, 1], [2, 1]]}, {}, "goal.targets", "the same"),
    ({"kind": "function", "targets": [[0, 1], [9, 2], [2, 1]]}, {}, "goal.targets", "515"),
    ({**FUNCTION, "function": "log(x)"}, {}, "goal.function", ""),
    ({**FUNCTION, "sense": "free"}, {}, "goal.sense", "turns as its values say"),
    (
        {"kind": "function", "targets": [[0, 1], [1, 2], [2, 4]], "measure": "exact"},
        {},
        "goal.measure",
        "made small",
    ),
    (FUNCTION, {"points": 3}, "points", "4 points"),
    (FUNCTION, {"within": {"points": 3}}, "within.points", "four-bar"),
    (FUNCTION, {"pairs": []}, "pairs", "turns"),
    (FUNCTION, {"friction": 0.1}, "friction", "no loss"),
    (FUNCTION, {"objectives": ["error", "loss"]}, "friction", "missing"),
    (
        FUNCTION,
        {"objectives": ["error", "loss"], "friction": 0.1, "pin_radius": 0.01, "load": [1, 2]},
        "load",
        "one number",
    ),
    (
        FUNCTION,
        {"objectives": ["error", "loss"], "friction": 0.0, "pin_radius": 0.01, "load": [1]},
        "friction",
        "positive",
    ),
]


@pytest.mark.parametrize(("goal", "changes", "where", "what"), WRONG)
def test_wrong_goals_are_named(goal, changes, where, what) -> None:
    with pytest.raises(MechdaeError) as caught:
        md.solve(composition(goal, **changes), "t")
    assert f"tasks.t.{where}" in caught.value.where
    assert what in str(caught.value)
