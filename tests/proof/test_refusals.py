"""Refusals that no altered certificate of a predefined problem leads to: hand-made false claims."""

from __future__ import annotations

import importlib
import json
import math
import random
import runpy
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.shared.certified import certificate, checked, refusal

flint = pytest.importorskip("flint", reason="python-flint is not installed")
from mechdae.parts.proof.checker import mechanism_of  # noqa: E402
from mechdae.parts.proof.checker.boxes import Boxes, LegBoxes  # noqa: E402
from mechdae.parts.proof.checker.space import rotation  # noqa: E402

CHECKER = "mechdae.parts.proof.checker"
FRAME = {"axis": ["1", "0", "0"], "zero": ["0", "1", "0"]}
BOTH_FRAMES = FRAME | {f"{key}2": values for key, values in FRAME.items()}
UNTURNED = ["1", "0", "0", "0"]


def carriage() -> dict[str, Any]:
    """A body on a guide along x whose point is driven from 0 to 1, and one pose of it."""
    guide = {"kind": "prismatic", "first": "ground.O", "second": "b.P", **BOTH_FRAMES}
    pose = {"pose": 0, "at": "1/2", "status": "ok", "bound": {}, "orientations": {"b": UNTURNED}}
    origin = ["0", "0", "0"]
    return {
        "certificate": 2,
        "kind": "sweep",
        "mechanism": {
            "dimension": 3,
            "bodies": {"ground": {"O": origin}, "b": {"P": origin}},
            "joints": {"guide": guide | {"unknown": []}},
            "drivers": {"b.P.x": "s"},
        },
        "path": {
            "at": "0",
            "bodies": {"b": [*origin, *UNTURNED]},
            "steps": [{"from": "0", "to": "1", "bodies": {"b": ["1", "0", "0", *UNTURNED]}}],
        },
        "poses": [pose | {"points": {"b.P": ["1/2", "0", "0"]}}],
    }


def follower(height: Any, *roots: float) -> dict[str, Any]:
    """A body on a guide along x that follows a curve (sin s, height): its places at y = 0."""
    ends = {"first": "ground.O", "second": "f.P"}
    modes = []
    for s in roots:
        x, place = str(Fraction(math.sin(s))), [str(Fraction(s))]
        bodies = {"f": [x, "0", "0"], "curve": place}
        modes.append({"bodies": bodies, "points": {}, "angles": {}, "bound": {}})
    return {
        "certificate": 2,
        "kind": "modes",
        "at": "0",
        "mechanism": {
            "bodies": {"ground": {"O": ["0", "0"]}, "f": {"P": ["0", "0"]}},
            "joints": {
                "curve": {"kind": "curve", **ends, "x": ["sin", "s"], "y": height},
                "guide": {"kind": "prismatic", **ends, "axis": "0", "turn": "0"},
            },
            "drivers": {},
        },
        "groups": [["f"]],
        "modes": modes,
    }


# -- the program -----------------------------------------------------------------------------------


def test_as_a_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    """It says what is proved, up to the first file that is refused; imported it checks nothing."""
    good, bad = tmp_path / "good.json", tmp_path / "bad.json"
    content = carriage()
    good.write_text(json.dumps(content), encoding="utf-8")
    content["poses"][0]["points"]["b.P"][0] = "1"
    bad.write_text(json.dumps(content), encoding="utf-8")
    monkeypatch.delitem(sys.modules, f"{CHECKER}.__main__", raising=False)
    for files, count in (([good, good], 2), ([good, bad, good], 1)):
        monkeypatch.setattr(sys, "argv", ["checker", *map(str, files)])
        if bad in files:
            with pytest.raises(SystemExit, match=r"^refused: poses/0/points/b\.P: further off"):
                runpy.run_module(CHECKER, run_name="__main__")
        else:
            runpy.run_module(CHECKER, run_name="__main__")
        assert capsys.readouterr().out.count("1 steps, 0 limit positions, from 0 to 1") == count
    importlib.import_module(f"{CHECKER}.__main__")
    assert capsys.readouterr().out == ""


# -- laws and coordinates --------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["pole", "corner"])
def test_laws_are_smooth_along_the_way(kind: str, tmp_path: Path) -> None:
    """0 / (s - c), and |s - c| as a root of a square: at s = c within a step none has a value."""
    content = certificate("laws")
    step = content["path"]["steps"][0]
    first, to = Fraction(step["from"]), Fraction(step["to"])
    for c, within in ((first - 1, False), ((2 * first + to) / 3, True)):
        off: Any = ["+", "s", str(-c)]
        none = ["/", "0", off]
        if kind == "corner":  # nothing is added up to c, or from c on
            sign = "1" if within else "-1"
            none = ["+", ["sqrt", ["*", off, off]], ["*", sign, off]]
        altered = certificate("laws")
        drivers = altered["mechanism"]["drivers"]
        drivers["link.P.x"] = ["+", drivers["link.P.x"], none]
        if within:
            why = refusal(altered, tmp_path)
            assert why.startswith("path/steps/0 ")
            part = "a divisor" if kind == "pole" else "what a root is taken of"
            assert f"on: {part} may vanish" in why
        else:
            assert "poses" in checked(altered, tmp_path)


def test_angles_of_joints_have_a_sense(tmp_path: Path) -> None:
    content = certificate("limits")
    content["mechanism"]["drivers"] = {"A.angle": "s"}
    assert " 7 poses" in checked(content, tmp_path)
    joint = content["mechanism"]["joints"]["A"]
    joint["first"], joint["second"] = joint["second"], joint["first"]
    assert "path/bodies/" in refusal(content, tmp_path)


@pytest.mark.parametrize("name", ["A.slide", "nothing.angle", "left.nowhere.x", "A.angle.x", "A"])
def test_coordinates_that_are_none(name: str, tmp_path: Path) -> None:
    content = certificate("limits")
    content["mechanism"]["drivers"] = {name: "s"}
    assert f"no such coordinate: {name}" in refusal(content, tmp_path)


@pytest.mark.parametrize("name", ["b.Q.x", "b.P.w", "guide.angle", "guide.length", "b.x"])
def test_coordinates_in_space_that_are_none(name: str, tmp_path: Path) -> None:
    content = carriage()
    content["mechanism"]["drivers"] = {name: "s"}
    assert f"no such coordinate: {name}" in refusal(content, tmp_path)


def test_points_are_driven_in_space(tmp_path: Path) -> None:
    """Along the guide, also by its slide; across it nothing moves."""
    content = carriage()
    assert " 1 poses" in checked(content, tmp_path)
    content["mechanism"]["drivers"] = {"guide.slide": "s"}
    assert " 1 poses" in checked(content, tmp_path)
    content["mechanism"]["drivers"] = {"b.P.y": "s"}
    assert refusal(content, tmp_path)
    content["mechanism"]["drivers"] = {"b.P.x": ["0", "2"]}
    assert "path/steps/0/bodies/b" in refusal(content, tmp_path)


def test_poses_are_those_at_the_values_of_laws_that_are_reported(tmp_path: Path) -> None:
    """A value that is rounded moves the pose; one that is further off is none of the law."""
    content = carriage()
    pose = content["poses"][0]
    pose["drivers"] = {"b.P.x": str(Fraction(1, 2) + Fraction(1, 10**13))}
    assert "poses/0/points/b.P" in refusal(content, tmp_path)
    pose["points"]["b.P"][0] = pose["drivers"]["b.P.x"]
    assert " 1 poses" in checked(content, tmp_path)
    pose["points"]["b.P"][0] = pose["drivers"]["b.P.x"] = str(Fraction(1, 2) + Fraction(1, 10**11))
    assert "or not at the values of the laws" in refusal(content, tmp_path)


def test_bars_have_their_length(tmp_path: Path) -> None:
    """The coupler of a four-bar as the distance of two points, and by a millionth longer."""
    content = certificate("limits")
    mechanism, path = content["mechanism"], content["path"]
    length = mechanism["bodies"].pop("coupler")["C"][0]
    del mechanism["joints"]["C"]
    ends = {"first": "left.B", "second": "right.C"}
    mechanism["joints"]["B"] = {"kind": "distance", **ends, "length": length}
    for place in (path, path["low"], path["high"], *path["steps"]):
        del place["bodies"]["coupler"]
    for pose in content["poses"]:
        pose.get("angles", {}).pop("coupler", None)
        for point in [name for name in pose.get("points", {}) if name.startswith("coupler.")]:
            del pose["points"][point]
    assert "2 limit positions" in checked(content, tmp_path)
    mechanism["joints"]["B"]["length"] = str(Fraction(length) + Fraction(1, 10**6))
    assert "path/bodies/" in refusal(content, tmp_path)


# -- paths -----------------------------------------------------------------------------------------


def test_limit_positions_are_where_the_driver_turns_back(tmp_path: Path) -> None:
    """Up to twice the way to a place before it, the driver does not."""
    for word, end in (("low", "bodies"), ("high", "steps")):
        content = certificate("limits")
        path = content["path"]
        last = path["bodies"] if end == "bodies" else path["steps"][-1]["bodies"]
        for body, numbers in path[word]["bodies"].items():
            pairs = [(Fraction(a), Fraction(b)) for a, b in zip(last[body], numbers, strict=True)]
            path[word]["bodies"][body] = [str(a + (b - a) * 3 / 10) for a, b in pairs]
        why = refusal(content, tmp_path)
        assert f"path/{word} " in why
        assert "the driver does not turn back" in why


def test_change_points_are_of_the_plane(tmp_path: Path) -> None:
    content = carriage()
    content["path"]["steps"][0]["through"] = {"at": "0", "bodies": {}}
    why = refusal(content, tmp_path)
    assert why.startswith("path/steps/0 ")
    assert "change points are checked in the plane" in why


def test_steps_across_a_change_point_end_behind_it(tmp_path: Path) -> None:
    content = certificate("folding")
    path = content["path"]
    k = next(k for k, step in enumerate(path["steps"]) if "through" in step)
    first, way = Fraction(path["steps"][k]["from"]), Fraction(math.pi / 2)
    path["steps"] = path["steps"][: k + 1]
    path["steps"][k]["to"] = str((first + way) / 2)
    why = refusal(content, tmp_path)
    assert why.startswith(f"path/steps/{k}/through ")
    assert "does not lead across" in why


# -- redundant equations of the plane ------------------------------------------------------------


def barred(word: str, error: Fraction) -> dict[str, Any]:
    """A parallelogram with a bar beside its cranks, in place of the pin R of one of them."""
    content = certificate(word)
    mechanism = content["mechanism"]
    mechanism["bodies"]["ground"]["X"] = mechanism["bodies"]["rod"]["X"] = ["0", "1"]
    length = str(Fraction(mechanism["bodies"]["crank"]["P"][0]) + error)
    ends = {"first": "ground.X", "second": "rod.X"}
    mechanism["joints"]["bar"] = {"kind": "distance", **ends, "length": length}
    mechanism["superfluous"] = ["10", "11"]
    return content


def test_bars_are_met_along_a_motion(tmp_path: Path) -> None:
    content = barred("rod", Fraction(0))
    assert [*mechanism_of(content["mechanism"]).counted] == ["A", "B", "C", "P", "Q", "bar"]
    assert "2 redundant equations that hold identically" in checked(content, tmp_path)
    content["mechanism"]["superfluous"] = ["11", "12"]
    assert "not the number of an equation of a pin" in refusal(content, tmp_path)
    why = refusal(barred("rod", Fraction(1, 10**30)), tmp_path)
    assert "equation 12 does not hold along the motion" in why


def test_equations_that_are_needed_are_not_left_out(tmp_path: Path) -> None:
    """Without its pin on the rod a crank turns freely: poses of what is left are not alone."""
    assert "singular matrix" in refusal(barred("rods", Fraction(0)), tmp_path)


@pytest.mark.parametrize("turn", [["1/2", "0"], ["1", "1/2"], ["1001", "0"]])
def test_angles_of_a_motion_have_exact_cosines(turn: list[str], tmp_path: Path) -> None:
    content = certificate("rod")
    content["mechanism"]["motion"]["rear"][2] = turn
    assert "no exact cosine of such an angle" in refusal(content, tmp_path)


# -- modes -----------------------------------------------------------------------------------------


def test_real_poses_are_not_hidden_among_complex_ones(tmp_path: Path) -> None:
    """A real pose that is said to be next to the real ones, and its mode left out."""
    content = certificate("modes")
    for pair in content["complex"][0]:
        pair[1] = f"1/{10**30}"
    del content["modes"][0]
    why = refusal(content, tmp_path)
    assert why.startswith("complex/0 ")
    assert "neither real nor not" in why


def test_contacts_are_counted_where_they_are_apart(tmp_path: Path) -> None:
    """Next to two contacts a curve may touch without crossing; one is where two parts meet."""
    third = 2 * math.pi / 3
    waves = ["+", ["cos", "s"], "1/2"]
    proved = checked(follower(waves, third, -third), tmp_path)
    assert proved == "2 modes, and no others: signs along the whole curve"
    for heights, roots in (
        (["*", waves, ["+", "1", ["*", "-1", ["cos", "s"]]]], (third, -third)),
        (["sin", ["+", "s", "-1/7"]], (1 / 7, 1 / 7 + math.pi)),
    ):
        why = refusal(follower(heights, *roots), tmp_path)
        assert why.startswith("modes ")
        assert "contacts of f that are too near each other" in why


def test_turns_of_screws_are_no_further_modes(tmp_path: Path) -> None:
    """A thread that is a turn further moves the ram, and the plate on it, by its pitch."""
    content = certificate("screw-press")
    mechanism, mode = content["mechanism"], content["modes"][0]
    mechanism["bodies"]["plate"] = {"W": ["0", "0", "0"]}
    ends = {"first": "ram.R", "second": "plate.W"}
    mechanism["joints"]["weld"] = {"kind": "weld", **ends, **BOTH_FRAMES, "unknown": []}
    mechanism["superfluous"] = [str(int(k) + 1) for k in mechanism["superfluous"]]
    content["groups"].append(["plate"])
    numbers, order = mode["bodies"], ("spindle", "ram", "plate", "nut", "thread")
    numbers["plate"] = list(numbers["ram"])
    mode["signs"].append("1")
    content["complex"] = [[[v, "0"] for owner in order for v in numbers[owner]]]
    assert checked(content, tmp_path).startswith("1 modes, and no others")
    pitch = Fraction(mechanism["joints"]["thread"]["pitch"])
    further = json.loads(json.dumps(mode))
    turn = Fraction("6.28318530717958647692528676655900576839433879875021")
    further["points"], further["orientations"] = {}, {}
    further["bodies"]["thread"] = [str(Fraction(numbers["thread"][0]) + turn)]
    for body in ("ram", "plate"):
        further["bodies"][body][2] = str(Fraction(numbers[body][2]) - pitch)
    content["complex"].append([[v, "0"] for owner in order for v in further["bodies"][owner]])
    why = refusal(content, tmp_path)
    assert why.startswith("complex/1 ")
    assert "stands there twice" in why
    # alone it is a pose like the first one
    content["complex"], content["modes"] = content["complex"][1:], [further]
    assert checked(content, tmp_path).startswith("1 modes, and no others")


def test_boxes_are_given_up_where_no_leg_reaches(monkeypatch: pytest.MonkeyPatch) -> None:
    """In boxes drawn at random, where none is left a leg is too long or short at all places."""
    rng = random.Random(7)
    grid = [[str(rng.randint(-5, 5)) for _ in range(3)] for _ in range(12)]
    ground, body = ({f"P{k}": place for k, place in enumerate(grid[i::2])} for i in (0, 1))
    squares = [
        sum((int(b) + up - int(a)) ** 2 for a, b, up in zip(one, other, (0, 0, 9), strict=True))
        for one, other in zip(ground.values(), body.values(), strict=True)
    ]
    legs = {
        f"L{k}": {
            "kind": "distance",
            "first": f"ground.P{k}",
            "second": f"b.P{k}",
            "square": str(v),
        }
        for k, v in enumerate(squares)
    }
    bodies = {"ground": ground, "b": body}
    m: Any = mechanism_of({"dimension": 3, "bodies": bodies, "joints": legs, "drivers": {}})
    pose = [flint.arb(v) for v in (0, 0, 9, 1, 0, 0, 0, 0)]
    boxes = LegBoxes(m, ["b"], [*m.joints.values()], {"ground"}, pose)
    monkeypatch.setattr(Boxes, "shrunk", lambda self, box, modes: box)

    def misses(q: list[float], T: list[float]) -> list[float]:
        R = np.array(rotation(*(np.array(q) / np.linalg.norm(q))), float)
        ends = [(np.array(b, float), np.array(p, float), float(r)) for b, p, r in boxes.legs]
        return [float(np.linalg.norm(T + R @ p - b)) - reach for b, p, reach in ends]

    assert max(map(abs, misses([1, 0, 0, 0], [0, 0, 9 / m.size]))) < 1e-12
    at_pose = [0.0] * 5 + [9 / m.size]
    for _ in range(60):  # boxes around the pose
        half = [10 ** rng.uniform(-6, 0) for _ in "qT" for r in [1] * 3]
        middle = [c + r * rng.uniform(-1, 1) for c, r in zip(at_pose, half, strict=True)]
        assert boxes.shrunk((0, middle, half), []) is not None
    given_up = 0
    for _ in range(60):
        middle = [rng.uniform(-1, 1) for _ in range(3)] + [rng.uniform(-4, 4) for _ in range(3)]
        half = [10 ** rng.uniform(-2, 0)] * 3 + [10 ** rng.uniform(-2, 1)] * 3
        if boxes.shrunk((0, middle, half), []) is not None:
            continue
        given_up += 1
        places = []
        for _ in range(8):
            x = [c + r * rng.choice((-1, 1)) for c, r in zip(middle, half, strict=True)]
            places.append(misses([1, *x[:3]], x[3:]))
        assert any(min(leg) > 0 or max(leg) < 0 for leg in zip(*places, strict=True))
    assert 10 < given_up < 60
