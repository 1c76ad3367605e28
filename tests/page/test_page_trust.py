"""What a page believes of itself: right ones near singular poses are believed, no wrong ones."""

from __future__ import annotations

import pytest

import mechdae as md
from tests.reference.truth.drawing import draw
from tests.reference.truth.judging import swept
from tests.shared.live import tables_of
from tests.shared.node import needs_node
from tests.shared.player import Player

pytestmark = needs_node
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


def places_of(tables, forms=("Math.sin({0})", "Math.cos({0})")) -> list[int]:
    """Return where functions of some forms stand in the kernel of poses."""
    codes = tables["functions"]["pose"]["streams"][0]
    letters = {chr(35 + tables["forms"].index(form)) for form in forms}
    return [k for k, letter in enumerate(codes) if letter in letters]


def spoilt(page: md.Page, k: int, share: float):
    """Return the tables of a page with a mistake in the k-th sine or cosine of its poses."""
    tables = tables_of(page.html)
    at = places_of(tables)[k]
    streams, forms = tables["functions"]["pose"]["streams"], tables["forms"]
    forms.append(f"({1 + share!r}*{forms[ord(streams[0][at]) - 35]})")
    streams[0] = streams[0][:at] + chr(34 + len(forms)) + streams[0][at + 1 :]
    return tables


@pytest.mark.parametrize(
    ("page", "share"),
    [("four-bar-crank-rocker", 1e-10), ("gorshkov-seven-link", 1e-10), (30, 1e-9)],
    ids=["four-bar", "seven-link", "near a singular pose"],
)
def test_mistakes_are_seen(page, share, player):
    """Each sine and cosine of the poses in turn is wrong by a small share."""
    made = drawn(page) if isinstance(page, int) else md.page(page)
    count = len(places_of(tables_of(made.html)))
    assert count >= 6
    question = "return session.trusted"
    believed = [k for k in range(count) if player.asks(made, question, spoilt(made, k, share))]
    assert believed == []
