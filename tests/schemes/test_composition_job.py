"""A task of composition as a whole: front, certificate, log, workers, pictures, wrong input."""

from __future__ import annotations

import json
import tomllib
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.describe.file.load import from_dict
from mechdae.errors import InputError, MechdaeError
from mechdae.parts.types.schemes.shape import Wanted, distances
from tests.reference.circles import followed, of_file
from tests.shared.scheme_cases import BEAN

TURN = 2 * np.pi


def problem(**changes):
    data = tomllib.loads(BEAN)
    data["tasks"]["scheme"] |= changes
    return from_dict(data, "bean")


@cache
def found():
    return md.solve(problem(), "scheme")


SHORT = {"grow": 0, "samples": 200, "starts": 3}
"""A search without growth."""


def test_designs_are_a_front_of_certified_mechanisms() -> None:
    """Each file is followed by circles alone: it assembles at 20 001 angles and has its error."""
    result = found()
    designs = result.data["designs"]
    assert len(designs) >= 4
    values = np.array([own["objectives"] for own in designs])
    for k, own in enumerate(values):
        assert not ((values <= own).all(axis=1) & (values < own).any(axis=1)).any(), k
    wanted = Wanted(np.array([complex(*corner) for corner in result.summary["curve"]]))
    assert values[:, 0].min() < 0.2
    for own in designs:
        places, links = of_file(own["problem"])
        points, least = followed(places, links, TURN * np.arange(20001) / 20000)
        assert least > 0
        ends = points["P"][[0, -1]]
        assert abs(ends[1] - ends[0]) < 1e-9
        curve, _ = followed(places, links, TURN * np.arange(720) / 720)
        error = distances(curve["P"][None] / wanted.radius, wanted)[0]
        assert error == pytest.approx(own["error"], rel=1e-9, abs=1e-12)
        # laid on the wanted curve: no point of the path is far from it
        gaps = np.abs(curve["P"][:, None] - wanted.corners[None, :]).min(axis=1)
        assert gaps.mean() < (own["error"] / TURN + 0.02) * wanted.radius
        bars = 0.0
        for link in links[1:]:
            spots = [complex(*places[name]) for name in link]
            bars += sum(abs(b - a) for k, a in enumerate(spots) for b in spots[k + 1 :])
        assert own["material"] == pytest.approx(2 * bars, rel=1e-9)


def test_the_hypervolume_is_that_of_rectangles() -> None:
    front = found().summary["front"]
    points = sorted(front["points"])
    reference = front["reference"]
    area, top = 0.0, reference[1]
    for error, amount in points:
        if error < reference[0] and amount < top:
            area += (reference[0] - error) * (top - amount)
            top = amount
    assert front["hypervolume"] == pytest.approx(area, rel=1e-12)


def same(one, other) -> None:
    assert json.dumps(one.data["designs"]) == json.dumps(other.data["designs"])


def test_a_job_that_was_broken_off_gives_the_same(tmp_path) -> None:
    whole = md.synthesize(problem(), "scheme", out=tmp_path / "job")
    same(whole, found())
    log = tmp_path / "job" / "pieces.jsonl"
    lines = log.read_bytes().splitlines(keepends=True)
    assert len(lines) > 6
    # what a killed process leaves: some finished pieces, and the beginning of a line
    log.write_bytes(b"".join(lines[:4]) + lines[4][:50])
    done = []
    again = md.synthesize(
        problem(), "scheme", out=tmp_path / "job", progress=lambda *told: done.append(told)
    )
    same(again, whole)
    assert sorted(log.read_bytes().splitlines()) == sorted(b"".join(lines).splitlines())
    assert done[-1][0] == done[-1][1] >= len(lines) - 1
    with pytest.raises(InputError, match=r"holds another job: tasks\.scheme\.seed"):
        md.synthesize(problem(seed=4), "scheme", out=tmp_path / "job")


def test_workers_and_executors_give_the_same_bits() -> None:
    alone = md.solve(problem(**SHORT), "scheme")
    assert alone.data["designs"]
    same(md.synthesize(problem(**SHORT), "scheme", workers=2), alone)
    with ThreadPoolExecutor(2) as executor:
        same(md.synthesize(problem(**SHORT), "scheme", executor=executor), alone)


def test_command_line(tmp_path, capsys) -> None:
    path = tmp_path / "bean.toml"
    path.write_text(BEAN.replace("grow = 1", "grow = 0").replace("samples = 600", "samples = 200"))
    out = tmp_path / "out"
    assert main(["synthesize", str(path), "--out", str(out), "--quiet"]) == 0
    text = capsys.readouterr().out
    assert "front" in text
    assert "census" in text
    assert (out / "scheme-1.toml").exists()
    assert main(["solve", str(out / "scheme-1.toml"), "--quiet"]) == 0
    assert main(["show", str(path)]) == 0
    assert main(["plot", str(out), "--kind", "sheet", "--out", str(tmp_path)]) == 0
    assert main(["plot", str(out), "--out", str(tmp_path)]) == 0
    assert main(["plot", str(out), "--kind", "design", "--out", str(tmp_path)]) == 2
    assert "composition" in capsys.readouterr().err


def test_limits_are_kept_and_what_cannot_be_met_is_said() -> None:
    limits = {"material": 16.0, "transmission_angle": 0.35}
    result = md.solve(problem(within=limits, grow=0), "scheme")
    assert result.data["designs"]
    for own in result.data["designs"]:
        assert own["material"] <= 16.0
        assert own["transmission_angle_min"] >= 0.35 - 1e-9
    result = md.solve(problem(within={"error": 1e-6}, **SHORT), "scheme")
    assert not result.data["designs"]
    assert "error = 1e-06" in result.fault
    assert "no proof" in result.fault


LINE = [[k / 10, 0.1 * k] for k in range(11)]
ROUND = [[float(np.cos(s)), float(np.sin(2 * s))] for s in np.linspace(0, TURN, 30)[:-1]]
WRONG = [
    ({"goal": {"kind": "curve", "targets": LINE}}, "goal.targets", "not closed"),
    ({"goal": {"kind": "curve", "targets": ROUND, "closed": False}}, "goal.closed", "closed"),
    ({"goal": {"kind": "curve", "x": "s", "y": "sin(s)"}}, "goal.range", "not closed"),
    ({"goal": {"kind": "curve", "targets": ROUND[:3]}}, "goal.targets", "five"),
    ({"goal": {"kind": "curve", "x": "cos(s)"}}, "goal", "'x' and 'y'"),
    ({"chains": ["wat"], "links": None}, "chains[0]", "watt"),
    ({"links": [5]}, "links[0]", "4, 6, 8"),
    ({"links": [10]}, "links[0]", "230 chains"),
    ({"links": [8], "points": 6}, "points", "10 points"),
    ({"within": {"joints": 3}}, "within.joints", "four-bar has 4"),
    ({"within": {"cost": 3}}, "within", "cost"),
    ({"pairs": ["P"]}, "pairs", "two turning pairs"),
    ({"pairs": ["R", "Q"]}, "pairs[1]", "'Q'"),
    ({"pairs": ["R", "R"]}, "pairs[1]", "twice"),
    ({"objectives": ["weight"]}, "objectives[0]", "weight"),
    ({"objectives": ["error"]}, "reference", "1 numbers"),
]


@pytest.mark.parametrize(("changes", "where", "what"), WRONG)
def test_wrong_input_is_named(changes, where, what) -> None:
    data = tomllib.loads(BEAN)
    data["tasks"]["scheme"] |= changes
    for key in [key for key, value in changes.items() if value is None]:
        del data["tasks"]["scheme"][key]
    with pytest.raises(MechdaeError) as caught:
        md.solve(from_dict(data, "bean"), "scheme")
    assert f"tasks.scheme.{where}" in caught.value.where
    assert what in str(caught.value)
