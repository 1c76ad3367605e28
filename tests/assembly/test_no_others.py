"""That a search has missed no mode, by looking at all angles and lengths box by box."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.assembly import no_others
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
    for search, found, z, u in asked[:]:
        assert no_others.no_others(search, found, z, u) > 0
        for k in range(len(found)):
            assert no_others.no_others(search, np.delete(found, k, axis=0), z, u) == 0


def test_wheels_that_roll_without_end_are_not(monkeypatch: pytest.MonkeyPatch) -> None:
    result, _ = looked(38, monkeypatch)
    assert not result.summary["proven"]
    assert "no others" not in result.summary["basis"]


def test_a_wheel_on_a_rack_between_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    """One angle: as far as the wheel can roll, against zeros of the equation on a fine grid."""
    result, ((search, found, z, u),) = looked(293, monkeypatch)
    assert result.summary["proven"]
    angle = np.linspace(-400, 400, 800_001)
    F = search.function(angle[:, None], z, u, search.solver.p)[0][:, 0]
    assert np.count_nonzero(F[1:] * F[:-1] < 0) == len(found) == 1
    assert no_others.no_others(search, found[:0], z, u) == 0
