"""Lists in all kinds of certificates: an entry less, twice, elsewhere is refused or said."""

from __future__ import annotations

import copy
import itertools
import json
import math
import random
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

import mechdae as md
from mechdae.errors import SolveError
from tests.shared.altered_lists import NOT_ALL, OPEN, alterations_of_lists, is_fault
from tests.shared.certified import certificate, checked, refusal
from tests.shared.paths import DATA, ROOT

pytest.importorskip("flint", reason="python-flint is not installed")
from mechdae.parts.proof.checker import IN_PLANE, boxes, theorems_in_plane
from mechdae.parts.proof.write import certificate_of

LONG = ("slides", "space")
"""Certificates whose check takes longer: of these lists of numbers are left out."""
WORDS = (
    *("modes", "geared", "rod", "rods", "contacts", "spatial modes", "spatial vectors", "turns"),
    *LONG,
)
"""Of all kinds `tests.scripts.certificates` alters more lists."""


@pytest.mark.parametrize("word", WORDS)
def test_lists_that_are_altered_are_refused_or_said(
    word: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    content = certificate(word)
    unaltered = checked(content, tmp_path)
    assert ("and no others" if content["kind"] == "modes" else OPEN) in unaltered
    monkeypatch.setattr(boxes, "MOST_BOXES", 500)  # 34 boxes are enough for the right ones
    count, refused = 0, list[str | None]()
    for place, how, other in alterations_of_lists(content, random.Random(3), 1, word not in LONG):
        count += 1
        try:
            sentence = checked(other, tmp_path)
        except SolveError as error:
            refused.append(error.where)
        else:
            assert not is_fault(sentence, unaltered, place, how), (place, how, sentence)
    assert count > 3
    assert refused
    assert all(refused)  # with their places


def test_page_tells_what_became_of_lists() -> None:
    data = json.loads((ROOT / "docs" / "data" / "certificates.json").read_text(encoding="utf-8"))
    found = data["alterations_of_lists"]
    count, weaker = found["count"], found["weaker_claims"]
    (passed,) = found["passed"]
    assert passed.startswith("seals: moved ('groups',): 8 modes, and no others")
    page = (ROOT / "docs" / "theory/evidence/certificates.md").read_text(encoding="utf-8")
    assert f"Of {count} alterations of lists, in certificates of all kinds" in page
    assert f"{count - weaker - 1} are refused; {weaker} leave a weaker claim" in page


# -- modes that theorems do not count --------------------------------------------------------------

TURN = Fraction("6.28318530717958647692528676655900576839433879875021")


def modes_of(name: str) -> dict[str, Any]:
    """Return the certificate that is written of the modes of a file, unchecked."""
    return certificate_of(md.load(DATA / f"{name}.toml"), "modes")


def eccentric_roots(content: dict[str, Any]) -> int:
    """Return how often the wheel's turn meets the rack: sign changes of one function of it."""
    joint = content["mechanism"]["joints"]["R"]
    r, phase = (float(Fraction(joint[word])) for word in ("radius", "phase"))
    turns = [-30 + 0.001 * k for k in range(60001)]
    bx = 0.2 * math.cos(math.radians(60))
    gaps = [0.3 - bx - 0.1 * math.cos(turn) - r * turn - phase for turn in turns]
    return sum(a * b < 0 for a, b in itertools.pairwise(gaps))


def test_modes_of_an_eccentric_wheel_are_not_said_to_be_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An angle and its cosine in one equation: no theorem bounds how many solutions it has."""
    path = DATA / "eccentric-wheel-on-a-rack-0.15.json"
    content = json.loads(path.read_text(encoding="utf-8"))
    assert len(content["modes"]) == eccentric_roots(content) == 3
    with pytest.raises(md.InputError, match="whose poses no theorem of the checker counts: wheel"):
        md.certify(md.load(DATA / "eccentric-wheel-on-a-rack.toml"), "modes")
    for left in (3, 1):
        told = checked(content | {"modes": content["modes"][:left]}, tmp_path)
        assert told.startswith(f"{left} modes exist; {NOT_ALL}")
    twice = content | {"modes": [content["modes"][0]] * 2}
    assert "stands there twice" in refusal(twice, tmp_path)

    slip = IN_PLANE._replace(most=lambda *given: (IN_PLANE.most(*given)[0] or 1, "a slip"))
    monkeypatch.setattr("mechdae.parts.proof.checker.IN_PLANE", slip)
    told = checked(content | {"modes": content["modes"][:1]}, tmp_path)
    assert "and no others" in told  # so it would be without what is asked of the rack


def test_a_wheel_does_not_make_one_pose_of_its_arm_two(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A rocker has two poses; one of them with a turn more has its wheel elsewhere, and is no
    second one."""
    content = modes_of("wheel-geared-to-a-rocker")
    names = [body for body in content["mechanism"]["bodies"] if body != "ground"]
    first = content["modes"][0]
    turned = copy.deepcopy(first["bodies"])
    ratio = Fraction(content["mechanism"]["joints"]["G"]["ratio"])
    assert content["mechanism"]["joints"]["G"]["second"] == "wheel.E"
    for body, turn in (("rocker", TURN), ("wheel", TURN / ratio)):
        turned[body][2] = str(Fraction(turned[body][2]) + turn)
    silent = first | {"points": {}, "angles": {}}
    modes = [silent | {"bodies": own} for own in (first["bodies"], turned)]
    places = [[[v, "0"] for body in names for v in own["bodies"][body]] for own in modes]
    attack = content | {"modes": modes, "complex": places}
    assert "stands there twice" in refusal(attack, tmp_path)

    monkeypatch.setattr(theorems_in_plane, "wheels", lambda m: [])
    assert checked(attack, tmp_path).startswith("2 modes, and no others")
