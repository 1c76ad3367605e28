"""Bounds from reaches against derivatives and rounding at random places."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest

from mechdae.kernels.bounds import reaches
from mechdae.kernels.graphs.row_reaches import BoundsWithin
from tests.shared.reach_cases import parts, sampled, worst

LOOPS = ("RSSP", "RUSR", "RHSC", "RERC", "RRSRR", "RCCC", "RCUC", "RCRUP", "RPUC")


@pytest.mark.parametrize("loop", [*LOOPS, "platform"])
def test_nothing_exceeds_its_bound(loop: str) -> None:
    first, second, rounding = worst(loop, np.random.default_rng(5))
    assert 0.05 < first <= 1 + 1e-12
    assert 0.05 < second <= 1 + 1e-12
    assert 1e-4 < rounding <= 1


@pytest.mark.parametrize("loop", ["RERC", "RHEC", "RCRUP", "RPUC"])
def test_every_equation_is_bounded_by_reaches(loop: str) -> None:
    """Slides that turn nothing are not asked for, those that were eliminated are bounded too."""
    blocks = [rows for _, rows in parts(loop)[:-1]]
    assert len(blocks) == len(parts(loop)[0][0].blocks) == 3
    assert all(reach is not None for rows in blocks for reach in rows.reaches)
    assert any(rows.solved for rows in blocks) == (loop in ("RCRUP", "RPUC"))


@pytest.mark.parametrize("loop", ["RCRUP", "RPUC"])
def test_eliminated_slides_are_no_longer_than_bounded(loop: str) -> None:
    rng, ratios = np.random.default_rng(5), []
    for whole, rows in parts(loop):
        for key in rows.solved:
            symbol = next(s for s in whole.model.q.elements() if s.element_hash() == key)
            size, places = sampled(rows, whole, rng)
            bound = BoundsWithin(rows, ca.SX(ca.DM(size)), True).eliminated(symbol)
            assert bound is not None
            both = ca.Function("v", [rows.y, rows.p], [whole.expression(symbol), bound.size])
            ratios += [
                abs(float(v)) / float(b) for v, b in (both(y, whole.model.p_values) for y in places)
            ]
    assert 0.05 < max(ratios) <= 1


@pytest.mark.parametrize(("name", "share"), [("across", 0.5), ("size_of", 0.5)])
def test_too_short_reaches_are_seen(
    monkeypatch: pytest.MonkeyPatch, name: str, share: float
) -> None:
    exact: Callable[..., Any] = getattr(reaches, name)
    monkeypatch.setattr(reaches, name, lambda *given: share * exact(*given))
    assert worst("RRSRR", np.random.default_rng(5))[1] > 1
