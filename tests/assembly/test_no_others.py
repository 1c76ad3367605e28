"""That a search has missed no mode, by looking at all angles and lengths box by box."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.motion.assembly import no_others
from tests.attack.geared_counts import counted, draw

GEARED = [155, 466, 109, 246, 981, 1144, 1460]
"""Random groups with gears and belts, two to four unknowns, none to two of them lengths."""


def looked(seed: int, monkeypatch: pytest.MonkeyPatch) -> tuple[Any, list[tuple[Any, ...]]]:
    """Return the modes of a random mechanism and what was asked of `no_others`."""
    asked: list[tuple[Any, ...]] = []
    plain = no_others.no_others

    def keep(*arguments: Any) -> int:
        asked.append(arguments)
        return plain(*arguments)

    monkeypatch.setattr(no_others, "no_others", keep)
    linkage = draw(seed, "geared")
    task = md.Modes(drivers=linkage.at(linkage.pose))
    return md.solve(linkage.mechanism(linkage.sketch(linkage.pose)), task), asked


@pytest.mark.parametrize("seed", GEARED)
def test_groups_with_gears_are_proven(seed: int) -> None:
    """Newton's method from random starts, with equations of its own, finds no other pose."""
    count, proven, wrong = counted(seed)
    assert proven
    assert count > 0
    assert not wrong


@pytest.mark.parametrize("seed", [155, 246, 981])
def test_a_mode_left_out_is_seen(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    result, asked = looked(seed, monkeypatch)
    assert "no others in" in result.summary["basis"]
    for search, found, z, u, _ in asked[:]:
        assert no_others.no_others(search, found, z, u) > 0
        for k in range(len(found)):
            assert no_others.no_others(search, np.delete(found, k, axis=0), z, u) == 0


def test_wheels_that_roll_without_end_are_not(monkeypatch: pytest.MonkeyPatch) -> None:
    result, _ = looked(38, monkeypatch)
    assert not result.summary["proven"]
    assert "no others" not in result.summary["basis"]


def test_a_wheel_on_a_rack_between_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    """One angle: as far as the wheel can roll, against zeros of the equation on a fine grid."""
    result, ((search, found, z, u, _),) = looked(293, monkeypatch)
    assert result.summary["proven"]
    angle = np.linspace(-400, 400, 800_001)
    F = search.function(angle[:, None], z, u, search.solver.p)[0][:, 0]
    assert np.count_nonzero(F[1:] * F[:-1] < 0) == len(found) == 1
    assert no_others.no_others(search, found[:0], z, u) == 0


def asked_of(name: str, monkeypatch: pytest.MonkeyPatch) -> tuple[Any, tuple[Any, ...]]:
    """Return the modes of a predefined mechanism and what was asked of `no_others`."""
    asked: list[tuple[Any, ...]] = []
    plain = no_others.no_others

    def keep(*arguments: Any) -> int:
        asked.append(arguments)
        return plain(*arguments)

    monkeypatch.setattr(no_others, "no_others", keep)
    result = md.solve(name, "modes")
    (arguments,) = asked
    return result, arguments


@pytest.mark.parametrize(("name", "count"), [("bennett", 1), ("sarrus", 4), ("bricard", 2)])
def test_superfluous_equations_are_looked_at_too(
    name: str, count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Counts are those of closed forms. Solutions with flipped axes are no poses and no freedom.

    Bricard's ring has whole curves of them.
    """
    result, (search, found, z, u, senses) = asked_of(name, monkeypatch)
    assert (result.summary["count"], result.summary["proven"]) == (count, True)
    assert "no others in" in result.summary["basis"]
    assert "free" not in result.summary
    assert search.solver.graph.redundant
    monkeypatch.setattr(no_others, "MOST", 60_000)
    assert no_others.no_others(search, found, z, u, senses) > 0
    for k in range(len(found)):
        left = no_others.no_others(search, np.delete(found, k, axis=0), z, u, senses)
        x = np.zeros(search.solver.scene.x.numel())
        x[search.solver.graph.own] = found[k]
        proper = bool(senses[0].possible(senses[1], [x], u))
        assert (left > 0) == (not proper)


@pytest.mark.parametrize("seed", range(4))
def test_bennetts_mechanisms_have_one_mode(seed: int) -> None:
    """tan(P/2) tan(Q/2) = sin((beta + alpha)/2) / sin((beta - alpha)/2)."""
    rng = np.random.default_rng(seed)
    b, alpha = float(rng.uniform(1.2, 1.6)), float(rng.uniform(15, 35))
    at = float(rng.uniform(0.5, 2.5))
    found = md.solve(
        "bennett", md.Modes(md.Driver("P.angle", at=[at])), set={"b": b, "alpha_deg": alpha}
    )
    assert (found.summary["count"], found.summary["proven"]) == (1, True)
    beta, a = np.arcsin(b * np.sin(np.radians(alpha))), np.radians(alpha)
    half = np.sin((beta + a) / 2) / np.sin((beta - a) / 2) / np.tan(at / 2)
    assert np.exp(1j * found.joints["Q"].angle[0]) == pytest.approx(
        np.exp(2j * np.arctan(half)), abs=1e-11
    )
