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
from mechdae.errors import UnavailableError
from tests.shared.altered import KINDS, alter
from tests.shared.certified import certificate, checked, refusal
from tests.shared.paths import ROOT

flint = pytest.importorskip("flint", reason="python-flint is not installed")
from mechdae.parts.proof.checker import FalseClaim, mechanism_of  # noqa: E402
from mechdae.parts.proof.checker import boxes as all_boxes  # noqa: E402
from mechdae.parts.proof.checker.arithmetic import exact  # noqa: E402
from mechdae.parts.proof.checker.counts import PROOFS, mode_in_balls  # noqa: E402

TURNS = {"bennett": 1, "bricard": 2, "sarrus": 4, "flyball-governor": 4}
"""Modes: Bennett's, with the driver given (Bennett 1903); the orthogonal Bricard, two; Sarrus, each
leg bent to either side; each arm of the governor above or below its link."""
CHEAP = ("bennett", "flyball-governor")
"""Those whose boxes take no second."""


def test_there_are_no_others(tmp_path: Path) -> None:
    """The others by what `tests.scripts.certificates` found."""
    data = json.loads((ROOT / "docs" / "data" / "certificates.json").read_text())
    rows = [row for row in data["rows"] if row["task"] == "modes" and "proved" in row]
    found = {row["problem"]: row["proved"] for row in rows}
    for name, count in TURNS.items():
        assert found[name].startswith(f"{count} modes, ")
        if name in CHEAP:
            proved = checked(certificate(name), tmp_path)
            assert proved.startswith(f"{count} modes, and no others: nothing else in ")


@pytest.mark.parametrize("name", CHEAP)
def test_altered_certificates_are_refused_with_their_place(name: str, tmp_path: Path) -> None:
    rng, refused = random.Random(9), 0
    for kind in (*KINDS, *["number"] * 6):
        other, what = alter(certificate(name), kind, rng)
        if what:
            assert refusal(other, tmp_path), (kind, what)
            refused += 1
    assert refused > 7


def test_each_mode_that_is_left_out_is_missed(tmp_path: Path) -> None:
    content = certificate("flyball-governor")
    for k in range(4):
        modes = content["modes"][:k] + content["modes"][k + 1 :]
        assert "may be near" in refusal(content | {"modes": modes}, tmp_path)
    twice = [*content["modes"][:3], content["modes"][0]]
    why = refusal(content | {"modes": twice}, tmp_path)
    assert "may be near" in why or "stands there twice" in why


def test_kinds_of_proofs_are_not_exchanged(tmp_path: Path) -> None:
    """Boxes of turns say nothing of distances, and theorems ask for complex poses."""
    for name, proof in (("delta-robot", "turns"), ("sarrus", "places"), ("sarrus", "none")):
        refusal(certificate(name) | {"proof": proof}, tmp_path)


def boxes_of(name: str, group: int) -> Any:
    """Return the boxes of a group at the first mode, and the mode in balls."""
    content = certificate(name)
    m = mechanism_of(content["mechanism"])
    z = mode_in_balls(m, content["modes"][0], exact(content["at"], ""), "")
    bodies, known = content["groups"][group], {"ground"}.union(*content["groups"][:group])
    joints = [joint for joint in m.joints.values() if {*joint["bodies"]} & {*bodies}]
    return PROOFS[content["proof"]](m, bodies, joints, known, z), z


@pytest.mark.parametrize(("name", "group"), [("sarrus", 1), ("bennett", 1), ("delta-robot", 3)])
def test_equations_stay_within_their_bounds(name: str, group: int) -> None:
    """Derivatives are those of differences; in boxes drawn at random, equations and combinations
    of them differ from tangents by no more than is said, their slopes by `order` times as much."""
    boxes, _ = boxes_of(name, group)
    rng, tight = np.random.default_rng(5), 0.0
    chart, middle, half = boxes.first()[0]
    for _ in range(20):
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


def test_places_of_a_body_on_distances() -> None:
    """All 16 modes of the delta robot are places where the equations vanish, in each chart."""
    content = certificate("delta-robot")
    assert content["proof"] == "places"
    assert len(content["modes"]) == 16
    boxes, z = boxes_of("delta-robot", 3)
    mode = np.array([float(v) for v in boxes.mode(z)])
    for chart in range(4):
        if abs(mode[chart]) > 0.1:
            x = [*(np.delete(mode[:4], chart) / mode[chart]).tolist(), *mode[4:].tolist()]
            assert np.abs(np.array(boxes.at(chart, x)[0], float)).max() < 1e-12
            assert boxes.inside(boxes.mode(z), (chart, x, [1e-9] * 6))
            assert not boxes.inside(boxes.mode(z), (chart, [v + 1e-6 for v in x], [1e-9] * 6))
    # near a mode nothing else, and the mode itself is asked for
    chart = int(np.argmax(np.abs(mode[:4])))
    x = [*(np.delete(mode[:4], chart) / mode[chart]).tolist(), *mode[4:].tolist()]
    near = [(chart, [v + 1e-3 for v in x], [2e-3] * 6)]
    assert boxes.look(copy.deepcopy(near), [boxes.mode(z)]) < 100
    with pytest.raises(FalseClaim, match="may be near"):
        boxes.look(copy.deepcopy(near), [])


def test_groups_that_move_are_left_open(monkeypatch: Any) -> None:
    """A leg whose last hinge closed with itself would swing: it is refused, not long looked at."""
    monkeypatch.setattr(all_boxes, "MOST_BOXES", 200)
    boxes, z = boxes_of("sarrus", 1)
    boxes.cuts = [[side, side] for side, _ in boxes.cuts]  # a hinge that closes with itself
    boxes.bends = [bend for cut in boxes.cuts for bend in boxes.second_derivatives(cut)]
    with pytest.raises(FalseClaim, match="may be near"):
        boxes.look(boxes.first(), [boxes.mode(z)])


def test_what_neither_theorems_nor_boxes_count_is_refused() -> None:
    with pytest.raises(UnavailableError, match="move by themselves"):
        md.certify("peaucellier", "modes")
