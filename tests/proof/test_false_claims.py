"""False claims of one kind each are refused, and for the reason that makes them false."""

from __future__ import annotations

from collections.abc import Callable

import pytest

pytest.importorskip("flint", reason="python-flint is not installed")
from tests.shared.false_claims import CLAIMS


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: claim.__name__)
def test_false_claims_are_refused(claim: Callable[[], float]) -> None:
    assert claim() == 0
