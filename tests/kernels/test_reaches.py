"""Bounds from reaches against derivatives and rounding at random places."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from mechdae.kernels.bounds import reaches
from tests.shared.reach_cases import worst

LOOPS = ("RSSP", "RUSR", "RHSC", "RERC", "RRSRR", "RCCC", "RCUC")


@pytest.mark.parametrize("loop", [*LOOPS, "platform"])
def test_nothing_exceeds_its_bound(loop: str) -> None:
    first, second, rounding = worst(loop, np.random.default_rng(5))
    assert 0.05 < first <= 1 + 1e-12
    assert 0.05 < second <= 1 + 1e-12
    assert 1e-4 < rounding <= 1


@pytest.mark.parametrize(("name", "share"), [("across", 0.5), ("size_of", 0.5)])
def test_too_short_reaches_are_seen(
    monkeypatch: pytest.MonkeyPatch, name: str, share: float
) -> None:
    exact: Callable[..., Any] = getattr(reaches, name)
    monkeypatch.setattr(reaches, name, lambda *given: share * exact(*given))
    assert worst("RRSRR", np.random.default_rng(5))[1] > 1
