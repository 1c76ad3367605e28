"""What a page believes of itself: right ones near singular poses are believed, no wrong ones."""

from __future__ import annotations

import re

import pytest

import mechdae as md
from mechdae.parts.page import link
from tests.reference.truth.drawing import draw
from tests.reference.truth.judging import swept
from tests.shared.node import needs_node
from tests.shared.player import Player

pytestmark = needs_node
SINES = r"Math\.(?:sin|cos)\("
NEAR = {
    7: "the other way round",
    30: "up to 2e-7 rad before a limit position",
    64: "no pose in the task's range",
    68: "near a singular pose",
    9: "up to a pole",
    14: "nothing to solve",
}


@pytest.fixture(scope="module")
def player(tmp_path_factory):
    with Player(tmp_path_factory.mktemp("player")) as own:
        yield own


def drawn(seed: int) -> md.Page:
    """Return the page of a random mechanism."""
    case = draw(seed)
    assert case is not None
    return md.page(md.Problem(case.mechanism(), {"sweep": swept(case, 24)}))


@pytest.mark.parametrize("seed", NEAR, ids=NEAR.values())
def test_right_pages_are_believed(seed, player):
    page = drawn(seed)
    assert page.data["live"] is True
    assert player.asks(page, "return session.trusted") is True


def spoilt(page: md.Page, k: int, share: float) -> md.Page:
    """Return a page with a mistake in the k-th sine or cosine of its poses."""
    script = link.unpacked(page.html)
    start, end = script.index("function pose(M)"), script.index("function slopes(M)")
    found = list(re.finditer(SINES, script[start:end]))
    at = start + found[k].start()
    wrong = f"{script[:at]}{1 + share!r}*{script[at:]}"
    return md.Page(link.packed(wrong), page.data)


@pytest.mark.parametrize(
    ("page", "share"),
    [("four-bar-crank-rocker", 1e-10), ("gorshkov-seven-link", 1e-10), (30, 1e-9)],
    ids=["four-bar", "seven-link", "near a singular pose"],
)
def test_mistakes_are_seen(page, share, player):
    """Each sine and cosine of the poses in turn is wrong by a small share."""
    made = drawn(page) if isinstance(page, int) else md.page(page)
    script = link.unpacked(made.html)
    pose = script[script.index("function pose(M)") : script.index("function slopes(M)")]
    count = len(re.findall(SINES, pose))
    assert count >= 6
    believed = [
        k for k in range(count) if player.asks(spoilt(made, k, share), "return session.trusted")
    ]
    assert believed == []
