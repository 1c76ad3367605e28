"""Lists in all kinds of certificates: an entry less, twice, elsewhere is refused or said."""

from __future__ import annotations

import copy
import itertools
import json
import math
import random
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

import mechdae as md
from mechdae.errors import SolveError
from tests.shared.paths import DATA

pytest.importorskip("flint", reason="python-flint is not installed")
CASES = {
    "path": ("four-bar-double-rocker", "window", 7),
    "laws": ("pantograph", "poses", None),
    "modes": ("gorshkov-seven-link", "modes", None),
    "geared": ("geared-five-bar", "modes", None),
    "beam": ("parallelogram-three-cranks", "turn", 5),
    "rods": ("parallelogram-three-cranks", "modes", None),
    "crossing": ("kite", "turn", (-0.3, 0.0, 0.3)),
    "cam": ("cam-roller-follower", "turn", (0.0, 0.3)),
    "contacts": ("cam-roller-follower", "modes", None),
    "space": ("rssr", "poses", None),
    "superfluous": ("cardan-joint", "poses", None),
    "legs": ("delta-robot", "path", None),
    "spatial modes": ("cardan-joint", "modes", None),
    "vectors": ("vector-modules-spatial", "l_a_b", None),
    "turns": ("bennett", "modes", None),
}
OPEN = "of others nothing is claimed"
NOT_ALL = "that there are no others is not claimed"
SETS = ("modes", "complex", "superfluous", "unknown")
"""Lists whose order says nothing; so do the waves of a motion."""
PARTS = (
    *("mechanism", "path", "poses", "modes", "complex", "groups", "bodies", "joints", "drivers"),
    *("steps", "through", "points", "signs", "superfluous", "unknown", "motion", "sums", "axis"),
    *("orientations", "low", "high", "x", "y"),
)
PICKED = 1
"""Lists of each kind that are altered in each certificate."""
LONG = ("crossing", "cam", "space", "superfluous", "legs")
"""Certificates whose check takes a second: of these lists of numbers are left out."""


@pytest.fixture(scope="module")
def written() -> dict[str, dict[str, Any]]:
    found = {}
    for word, (name, task, poses) in CASES.items():
        problem = md.load(name)
        if poses:
            own = problem.tasks[task]
            at = {}
            if isinstance(poses, tuple):
                at = {"driver": md.Driver(own.driver.coordinate, at=poses)}
            poses = None if at else poses
            problem = problem.with_task(task, replace(own, poses=poses, **at))
        found[word] = md.certify(problem, task)
    return found


def lists(data: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the places of all lists."""
    if isinstance(data, list):
        yield place
    entries = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in entries:
        if isinstance(value, dict | list):
            yield from lists(value, (*place, key))


def altered(content: Any, place: tuple[Any, ...], how: str, rng: random.Random) -> Any:
    """Return a certificate with one list altered, None where that would change nothing."""
    own = copy.deepcopy(content)
    here = own
    for key in place:
        here = here[key]
    if not here:
        return None
    k = rng.randrange(len(here))
    if how == "less" and "motion" in place and here[k][:2] == ["0", "0"]:
        return None  # a wave that vanishes: b sin 0 s
    if how == "less":
        del here[k]
    elif how == "twice":
        here.insert(k, copy.deepcopy(here[k]))
    else:
        here.insert(rng.choice([i for i in range(len(here)) if i != k] or [k]), here.pop(k))
    return None if own == content else own


def checked(content: Any, folder: Path) -> str:
    path = folder / "c.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    return md.check_certificate(path)


def plan(written: dict[str, Any]) -> Iterator[tuple[str, tuple[Any, ...], str, Any]]:
    """Yield certificate, place of a list, what is done to it, and the altered content."""
    rng = random.Random(3)
    for word, content in written.items():
        kinds: dict[tuple[Any, ...], list[tuple[Any, ...]]] = {}
        for place in lists(content):
            known = (isinstance(key, str) and key in PARTS for key in place)
            kind = tuple(key if own else "-" for key, own in zip(place, known, strict=True))[:5]
            kinds.setdefault(kind, []).append(place)
        for places in kinds.values():
            for place in rng.sample(places, min(PICKED, len(places))):
                if word in LONG and place[-1] not in ("poses", "steps", *SETS):
                    continue
                numbers = any(isinstance(key, str) and key in SETS for key in place[-1:])
                for how in ("less", "twice", "moved"):
                    other = altered(content, place, how, rng)
                    if other is None or (how == "moved" and not moves(content, place, numbers)):
                        continue
                    yield word, place, how, other


def moves(content: Any, place: tuple[Any, ...], named: bool) -> bool:
    """Whether the order of a list of names or tables is asked: numbers have places, not an order"""
    here = content
    for key in place:
        here = here[key]
    return named or not any(isinstance(value, str) for value in here)


def is_set(place: tuple[Any, ...]) -> bool:
    inside = place[0] == "groups" and len(place) > 1
    return inside or bool({*SETS} & {place[-1], *place[:1]}) or "motion" in place


@pytest.mark.parametrize("word", CASES)
def test_lists_that_are_altered_are_refused_or_said(
    word: str, written: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from mechdae.certificates import check_space_turns

    told = checked(written[word], tmp_path)
    modes = written[word]["kind"] == "modes"
    assert ("and no others" if modes else OPEN) in told
    monkeypatch.setattr(check_space_turns, "MOST", 500)  # 34 boxes are enough for the right ones
    count, weaker, without = 0, 0, 0
    for _, place, how, content in plan({word: written[word]}):
        count += 1
        try:
            sentence = checked(content, tmp_path)
        except SolveError as refused:
            without += not refused.where
            continue
        if how == "moved" and is_set(place):
            assert sentence == told, place
            continue
        weaker += 1
        assert sentence != told, (place, how)
        assert OPEN in sentence or NOT_ALL in sentence, (place, how, sentence)
    assert count > 3
    assert without == 0
    assert weaker < count


# -- modes that theorems do not count --------------------------------------------------------------

TURN = Fraction("6.28318530717958647692528676655900576839433879875021")


def modes_of(name: str) -> dict[str, Any]:
    """Return the certificate that is written of the modes of a file, unchecked."""
    from mechdae.certificates.write import certificate_of

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
        certify_checked()
    for left in (3, 1):
        told = checked(content | {"modes": content["modes"][:left]}, tmp_path)
        assert told.startswith(f"{left} modes exist; that there are no others is not claimed")
    twice = content | {"modes": [content["modes"][0]] * 2}
    with pytest.raises(SolveError, match="stands there twice"):
        checked(twice, tmp_path)

    from mechdae.certificates import check_modes

    right = check_modes.most
    monkeypatch.setattr(check_modes, "most", lambda *own: (right(*own)[0] or 1, "a slip"))
    told = checked(content | {"modes": content["modes"][:1]}, tmp_path)
    assert "and no others" in told  # so it would be without what is asked of the rack


def certify_checked() -> None:
    md.certify(md.load(DATA / "eccentric-wheel-on-a-rack.toml"), "modes")


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
    with pytest.raises(SolveError, match="stands there twice"):
        checked(attack, tmp_path)

    from mechdae.certificates import check_modes

    monkeypatch.setattr(check_modes, "wheels", lambda m: [])
    assert checked(attack, tmp_path).startswith("2 modes, and no others")


def test_formulas_have_no_value_that_is_not_read(written: Any, tmp_path: Path) -> None:
    own = copy.deepcopy(written["laws"])
    name, law = next(iter(own["mechanism"]["drivers"].items()))
    assert isinstance(law, list)
    own["mechanism"]["drivers"][name] = [*law, "1"]
    with pytest.raises(SolveError, match="no formula"):
        checked(own, tmp_path)
