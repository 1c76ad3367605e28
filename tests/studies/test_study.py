"""Studies: a sweep for many sets of parameters, in lockstep and one by one."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.describe.file.load import from_dict

TURN = md.Sweep(md.Driver("crank.angle", from_=0, to=2 * np.pi, speed="w"), poses=73)


def four_bar() -> md.Problem:
    mechanism = md.Mechanism(
        ground=md.Ground({"A": (0, 0), "D": ("d", 0)}),
        bodies=[
            md.Body("crank", {"A": (0, 0), "B": ("a", 0)}),
            md.Body("coupler", {"B": (0, 0), "C": ("b", 0), "P": ("half", 0.04)}),
            md.Body("rocker", {"D": (0, 0), "C": ("c", 0)}),
        ],
        joints=[
            md.Revolute("A", "ground.A", "crank.A"),
            md.Revolute("B", "crank.B", "coupler.B"),
            md.Revolute("C", "coupler.C", "rocker.C"),
            md.Revolute("D", "ground.D", "rocker.D"),
        ],
        parameters={"a": 0.04, "b": 0.12, "c": 0.08, "d": 0.1, "half": "b/2", "w": 2.0},
        sketch={"crank": 1.0, "coupler": 0.3, "rocker": 1.4},
    )
    return md.Problem(mechanism, {"turn": TURN}, name="four-bar")


def closed(a: float, b: float, c: float, d: float, u: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return P and the rocker's angle of the open four-bar with P above the middle of b."""
    B = a * np.exp(1j * u.astype(np.longdouble))
    gap = d - B
    e = abs(gap)
    coupler = np.angle(gap) + np.arccos((e * e + b * b - c * c) / (2 * b * e))
    C = B + b * np.exp(1j * coupler)
    return B + (b / 2 + 0.04j) * np.exp(1j * coupler), np.unwrap(np.angle(C - d))


OUTPUTS = ("points/coupler.P/position", "bodies/rocker/angle", "bodies/rocker/angular_velocity")


def test_a_grid_in_lockstep_is_right() -> None:
    vary = {"a": [0.03, 0.04, 3], "b": [0.11, 0.13, 4], "d": [0.095, 0.11, 3]}
    result = md.solve(four_bar(), md.Study(vary=vary, of="turn", outputs=OUTPUTS))
    u = np.linspace(0, 2 * np.pi, 73)
    assert len(result) == 36
    assert set(result.status) == {"ok"}
    assert result.summary["work"] == {"together": 36, "alone": 0}
    for k in range(36):
        a, b, d = (float(result.parameters[name][k]) for name in ("a", "b", "d"))
        P, rocker = closed(a, b, 0.08, d, u)
        ours = result.table["points/coupler.P/position"][k]
        assert np.abs(ours[:, 0] + 1j * ours[:, 1] - P).max() < 1e-15
        assert np.abs(result.table["bodies/rocker/angle"][k] - rocker).max() < 1e-14
        h = 1e-5
        ahead, behind = (closed(a, b, 0.08, d, u + step)[1] for step in (h, -h))
        speed = 2 * (ahead - behind) / (2 * h)
        assert np.abs(result.table[OUTPUTS[2]][k] - speed).max() < 1e-8


def test_lockstep_and_one_by_one_agree() -> None:
    problem = four_bar()
    samples = {"a": [0.03, 0.041, 0.05], "c": [0.08, 0.079, 0.09], "w": [1.0, 2.0, -3.0]}
    together = md.solve(problem, md.Study(samples=samples, of="turn", outputs=OUTPUTS))
    single = md.solve(
        problem,
        md.Study(samples=samples, of="turn", outputs=(*OUTPUTS, "summary/time_ratio/rocker")),
    )
    assert together.summary["work"]["alone"] == 0
    assert single.summary["work"]["together"] == 0
    for path in OUTPUTS:
        assert together.table[path] == pytest.approx(single.table[path], rel=1e-12, abs=1e-12)


def test_swings_of_many_sets_are_those_of_the_dead_points() -> None:
    """The rocker's dead points are at b + a and b - a, by the law of cosines."""
    vary = {"a": [0.03, 0.04, 4], "b": [0.11, 0.13, 4], "c": [0.078, 0.085, 3]}
    outputs = ("summary/swing/rocker", "summary/swing/crank", "bodies/rocker/angle")
    result = md.solve(four_bar(), md.Study(vary=vary, of="turn", outputs=outputs))
    assert result.summary["work"] == {"together": 48, "alone": 0}
    a, b, c = (np.array(result.parameters[name], np.longdouble) for name in "abc")
    d = np.longdouble(0.1)
    far, near = (np.arccos((c * c + d * d - e * e) / (2 * c * d)) for e in (b + a, b - a))
    assert np.abs(result.table[outputs[0]] - (far - near)).max() < 1e-14
    assert np.abs(result.table[outputs[1]] - 2 * np.pi).max() < 1e-15
    for path, hint in (
        ("summary/swing/C", "summary/swing/"),
        ("summary/stroke/A", "summary/stroke"),
    ):
        with pytest.raises(md.UnknownName, match=hint):
            md.solve(four_bar(), md.Study(vary=vary, of="turn", outputs=(path,)))


def test_swings_in_space_are_told_by_joint() -> None:
    problem, vary = md.load("rssr"), {"r": [0.04, 0.05, 2]}
    study = md.Study(vary=vary, of="turn", outputs=("summary/swing/D", "summary/swing/A"))
    table = md.solve(problem.with_task("sizes", study), "sizes").table
    assert table["summary/swing/A"] == pytest.approx(2 * np.pi, rel=1e-15)
    assert table["summary/swing/D"][1] > table["summary/swing/D"][0] > 0
    wrong = replace(study, outputs=("summary/swing/rocker",))
    with pytest.raises(md.UnknownName, match="summary/swing/D"):
        md.solve(problem.with_task("sizes", wrong), "sizes")


def test_sets_that_lock_are_followed_alone_and_said() -> None:
    study = md.Study(samples={"a": [0.04, 0.07]}, of="turn", outputs=(OUTPUTS[1],))
    result = md.solve(four_bar(), study)
    assert list(result.status) == ["ok", "unassembled"]
    assert result.summary["work"] == {"together": 2, "alone": 0}
    assert np.isfinite(result.table[OUTPUTS[1]][0]).all()
    assert np.isnan(result.table[OUTPUTS[1]][1]).any()
    assert result.fault is None


@pytest.mark.parametrize("slip", ["branch", "pose"])
def test_a_lane_on_the_other_branch_is_not_kept(slip: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A lane that begins, or is guessed, on the other side of the dyad is not believed."""
    from mechdae.design.studies.batches import modes, poses

    begin, guess = modes.StartingModes.__call__, poses.LaneNodes.guess

    def other_start(self, numbers, u):
        starts = begin(self, numbers, u)
        swapped = self.form.poses(u[:, None], -starts.sign, numbers.p)[0]
        return replace(starts, x=np.where(np.arange(len(u))[:, None] == 1, swapped, starts.x))

    def other_guess(self, lanes, piece, places):
        right = guess(self, lanes, piece, places)
        return right + (self.lanes[piece] == 1)  # a radian off: Newton may end anywhere

    if slip == "branch":
        monkeypatch.setattr(modes.StartingModes, "__call__", other_start)
    else:
        monkeypatch.setattr(poses.LaneNodes, "guess", other_guess)
    study = md.Study(samples={"a": [0.039, 0.041]}, of="turn", outputs=(OUTPUTS[1],))
    result = md.solve(four_bar(), study)
    u = np.linspace(0, 2 * np.pi, 73)
    for k, a in enumerate((0.039, 0.041)):
        rocker = closed(a, 0.12, 0.08, 0.1, u)[1]
        assert np.abs(result.table[OUTPUTS[1]][k] - rocker).max() < 1e-14
    assert result.summary["work"]["alone"] == (1 if slip == "branch" else 0)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"vary": {"aa": [1, 2, 3]}}, "aa"),
        ({"vary": {"a": [1, 2]}}, "from, to, count"),
        ({"vary": {"a": [1, 2, 2.5]}}, "whole number"),
        ({"vary": {"a": [0.03, 0.04, 1000], "b": [0.1, 0.12, 1000]}}, "at most"),
        ({"samples": {"a": [1, 2], "b": [1]}}, "different lengths"),
        ({}, "vary"),
        ({"vary": {"a": [0.03, 0.04, 2]}, "outputs": ("bodies/rokcer/angle",)}, "rocker"),
        ({"vary": {"a": [0.03, 0.04, 2]}, "outputs": ("summary/swing/rokcer",)}, "rocker"),
        ({"vary": {"a": [0.03, 0.04, 2]}, "outputs": ("summary/swnig/rocker",)}, "summary/swing"),
        ({"vary": {"a": [0.03, 0.04, 2]}, "outputs": ()}, "paths"),
        ({"vary": {"a": [0.03, 0.04, 2]}, "of": "trun"}, "turn"),
    ],
)
def test_bad_studies(keys: dict, words: str) -> None:
    study = md.Study(of="turn", outputs=("bodies/rocker/angle",))
    with pytest.raises(md.InputError) as caught:  # noqa: PT012
        study = replace(study, **keys)
        md.solve(four_bar(), study)
    assert words in str(caught.value)


def test_a_value_that_no_set_has_is_no_error() -> None:
    """A time ratio is there only if it was asked for."""
    study = md.Study(of="turn", vary={"a": [0.03, 0.04, 2]}, outputs=("summary/time_ratio/rocker",))
    assert np.isnan(md.solve(four_bar(), study).table["summary/time_ratio/rocker"]).all()


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("vary = { a_mm = [30, 40, 2], a = [0.1, 0.2, 2] }", "tasks.map.vary: 'a' is given twice"),
        ('vary = { "coupler.P.x_deg" = [30, 40, 2] }', "tasks.map.vary.x_deg: the unit '_deg'"),
        ('samples = { "coupler.P.x_rpm" = [30, 40] }', "tasks.map.samples.x_rpm"),
    ],
)
def test_units_of_varied_numbers(line: str, words: str) -> None:
    text = md.dumps(four_bar())
    text += f'[tasks.map]\nkind = "study"\nof = "turn"\n{line}\noutputs = ["summary/swing"]\n'
    with pytest.raises(md.InputError) as caught:
        from_dict(tomllib.loads(text))
    assert words in str(caught.value)


def test_a_study_in_a_file(tmp_path, capsys) -> None:
    text = md.dumps(four_bar()) + (
        '[tasks.map]\nkind = "study"\nof = "turn"\n'
        "vary = { a_mm = [30, 40, 2], b = [0.11, 0.13, 2] }\n"
        'outputs = ["points/coupler.P/position", "summary/swing/rocker"]\n'
    )
    path = tmp_path / "map.toml"
    path.write_text(text)
    assert main(["solve", str(path), "--task", "map", "--json", "--out", str(tmp_path)]) == 0
    task = json.loads(capsys.readouterr().out)["tasks"]["map"]
    assert task["parameters"] == {"a": [0.03, 0.03, 0.04, 0.04], "b": [0.11, 0.13, 0.11, 0.13]}
    assert np.shape(task["table"]["points/coupler.P/position"]) == (4, 73, 2)
    assert np.shape(task["table"]["summary/swing/rocker"]) == (4,)
    assert "points/coupler.P/position[0][1]" in (tmp_path / "map.csv").read_text().split("\n")[0]
    assert main(["solve", str(path), "--task", "map"]) == 0
    names, units = capsys.readouterr().out.splitlines()[1:3]
    assert names.split() == ["status", "a", "b", *("least", "coupler.P/position"),
                             *("largest", "coupler.P/position"), "swing/rocker"]  # fmt: skip
    assert units.split() == ["[m]", "[m]", "[rad]"]


@pytest.mark.parametrize("path", ["summary", "status", "bound"])
def test_outputs_that_are_no_numbers_are_refused(path: str) -> None:
    study = md.Study(of="turn", samples={"a": [0.03, 0.04]}, outputs=(path,))
    with pytest.raises(md.InputError, match=f"{path} is no number"):
        md.solve(four_bar(), study)


def test_a_set_that_makes_no_mechanism_leaves_the_others() -> None:
    study = md.Study(of="turn", samples={"b": [0.12, 0.0]}, outputs=("summary/swing/rocker",))
    result = md.solve(four_bar(), study)
    assert list(result.status) == ["ok", "unassembled"]
    assert np.isfinite(result.table["summary/swing/rocker"]).tolist() == [True, False]
    (entry,) = result.summary["faults"]
    assert entry["set"] == 1
    assert "zero length" in entry["fault"]
    none = replace(study, samples={"b": [0.0, 0.0]})
    with pytest.raises(md.InputError, match="zero length"):
        md.solve(four_bar(), none)
