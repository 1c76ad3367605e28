"""Certificates of modes whose count follows from boxes: nothing else is left anywhere."""

from __future__ import annotations

import copy
import json
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.certificates.write import certificate_of
from mechdae.errors import SolveError, UnavailableError
from tests.shared.altered import KINDS, alter

flint = pytest.importorskip("flint", reason="python-flint is not installed")
from mechdae.certificates import check_space_places, check_space_turns  # noqa: E402

TURNS = {"bennett": 1, "bricard": 2, "sarrus": 4, "flyball-governor": 4}
"""Modes: Bennett's, with the driver given (Bennett 1903); the orthogonal Bricard, two; Sarrus, each
leg bent to either side; each arm of the governor above or below its link."""


@pytest.fixture(scope="module")
def written() -> dict[str, dict[str, Any]]:
    return {name: certificate_of(md.load(name), "modes") for name in (*TURNS, "delta-robot")}


def checked(content: Any, path: Path) -> str:
    path.write_text(json.dumps(content), encoding="utf-8")
    return md.check_certificate(path)


@pytest.mark.parametrize("name", TURNS)
def test_there_are_no_others(name: str, written: Any, tmp_path: Path) -> None:
    told = checked(written[name], tmp_path / "c.json")
    assert told.startswith(f"{TURNS[name]} modes, and no others: nothing else in ")


@pytest.mark.parametrize("name", ["bennett", "sarrus", "flyball-governor"])
def test_altered_certificates_are_refused_with_their_place(
    name: str, written: Any, tmp_path: Path
) -> None:
    rng, refused = random.Random(9), 0
    for kind in (*KINDS, *["number"] * 6):
        other, what = alter(written[name], kind, rng)
        if not what:
            continue
        with pytest.raises(SolveError, match="refused") as caught:
            print(kind, what, checked(other, tmp_path / "c.json"))
        assert caught.value.where, (kind, what)
        refused += 1
    assert refused > 8


def test_each_mode_that_is_left_out_is_missed(written: Any, tmp_path: Path) -> None:
    for k in range(4):
        other = copy.deepcopy(written["flyball-governor"])
        del other["modes"][k]
        with pytest.raises(SolveError, match="may be near"):
            checked(other, tmp_path / "c.json")
    other = copy.deepcopy(written["sarrus"])
    other["modes"][1] = other["modes"][0]
    with pytest.raises(SolveError, match=r"refused: \['high1'.*may be near|stands there twice"):
        checked(other, tmp_path / "c.json")


def test_kinds_of_proofs_are_not_exchanged(written: Any, tmp_path: Path) -> None:
    """Boxes of turns say nothing of distances, and theorems ask for complex poses."""
    for name, proof in (("delta-robot", "turns"), ("sarrus", "places"), ("sarrus", "none")):
        with pytest.raises(SolveError, match="refused"):
            checked(written[name] | {"proof": proof}, tmp_path / "c.json")


def boxes_of(checker: Any, content: Any, group: int) -> Any:
    """Return the boxes of a group at the first mode."""
    flint.ctx.prec, flint.ctx.cap = 128, 3
    m = checker.Checked(content["mechanism"])
    z = checker.proved(m, m.claimed(content["modes"][0], checker.exact(content["at"], ""), ""), "")
    known = {"ground"}.union(*content["groups"][:group])
    own = [j for j in m.joints.values() if {*j["bodies"]} & {*content["groups"][group]}]
    return checker.LOOKED[0](m, content["groups"][group], own, known, z), z


@pytest.mark.parametrize(
    ("checker", "name", "group"),
    [
        (check_space_turns, "sarrus", 1),
        (check_space_turns, "bennett", 1),
        (check_space_places, "delta-robot", 3),
    ],
)
def test_equations_stay_within_their_bounds(
    checker: Any, name: str, group: int, written: Any
) -> None:
    """Derivatives are those of differences; in boxes drawn at random, equations and combinations
    of them differ from tangents by no more than is said, their slopes by `order` times as much."""
    boxes, _ = boxes_of(checker, written[name], group)
    rng, tight = np.random.default_rng(5), 0.0
    chart, middle, half = boxes.first()[0]
    for _ in range(40):
        h = np.array(half) * 10.0 ** rng.uniform(-2.5, 0)
        c = np.array(middle) + rng.uniform(-1, 1, boxes.n) * (np.array(half) - h)
        F, J = (np.array(own, float) for own in boxes.at(chart, c.tolist()))
        W = rng.normal(size=(3, len(F))) * (rng.random((3, len(F))) < 0.5)
        rests = boxes.rests(flint.arb_mat(W.tolist()), c.tolist(), [flint.arb(v) for v in h])
        for sign in (*rng.choice([-1.0, 1.0], (4, boxes.n)), *rng.uniform(-1, 1, (4, boxes.n))):
            own, slopes = (np.array(v, float) for v in boxes.at(chart, (c + sign * h).tolist()))
            off = np.abs(W @ (own - F - (sign * h) @ J))
            bent = np.abs(W @ (slopes - J).T) @ h
            limits = np.array([float(rest) for rest in rests])
            assert (off <= limits + 1e-12).all()
            assert (bent <= boxes.order * limits + 1e-12).all()
            tight = max(tight, float((off / np.maximum(limits, 1e-12)).max()))
        step = 1e-6
        for k in range(boxes.n):
            d = step * np.eye(boxes.n)[k]
            rise = np.array(boxes.at(chart, (c + d).tolist())[0], float) - F
            assert np.abs(rise / step - J[k]).max() < 1e-3
    assert tight > 0.1  # the bounds are not far off


def test_places_of_a_body_on_distances(written: Any) -> None:
    """All 16 modes of the delta robot are places where the equations vanish, in each chart."""
    content = written["delta-robot"]
    assert content["proof"] == "places"
    assert len(content["modes"]) == 16
    boxes, z = boxes_of(check_space_places, content, 3)
    mode = np.array([float(v) for v in boxes.mode(z)])
    for chart in range(4):
        if abs(mode[chart]) > 0.1:
            x = [*(np.delete(mode[:4], chart) / mode[chart]).tolist(), *mode[4:].tolist()]
            assert np.abs(np.array(boxes.at(chart, x)[0], float)).max() < 1e-12
            assert boxes.inside(boxes.mode(z), chart, x, [1e-9] * 6)
            assert not boxes.inside(boxes.mode(z), chart, [v + 1e-6 for v in x], [1e-9] * 6)
    # near a mode nothing else, and the mode itself is asked for
    chart = int(np.argmax(np.abs(mode[:4])))
    x = [*(np.delete(mode[:4], chart) / mode[chart]).tolist(), *mode[4:].tolist()]
    near = [(chart, [v + 1e-3 for v in x], [2e-3] * 6)]
    assert boxes.look(copy.deepcopy(near), [boxes.mode(z)]) < 100
    with pytest.raises(check_space_places.FalseClaim, match="may be near"):
        boxes.look(copy.deepcopy(near), [])


def test_groups_that_move_are_left_open(monkeypatch: Any, written: Any) -> None:
    """A leg whose last hinge closed with itself would swing: it is refused, not long looked at."""
    monkeypatch.setattr(check_space_turns, "MOST", 500)
    boxes, z = boxes_of(check_space_turns, written["sarrus"], 1)
    boxes.cuts = [[side, side] for side, _ in boxes.cuts]  # a hinge that closes with itself
    boxes.bends = [bend for cut in boxes.cuts for bend in boxes.bent(cut)]
    with pytest.raises(check_space_turns.FalseClaim, match="may be near"):
        boxes.look(boxes.first(), [boxes.mode(z)])


def test_what_neither_theorems_nor_boxes_count_is_refused() -> None:
    with pytest.raises(UnavailableError, match="move by themselves"):
        md.certify("peaucellier", "modes")
