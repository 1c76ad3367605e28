"""Certificates of spatial assembly modes: counts of the field's theorems, alterations refused."""

from __future__ import annotations

import random
import re
from pathlib import Path
from typing import Any

import pytest

import mechdae as md
from tests.shared.altered import KINDS, alter
from tests.shared.certified import certificate, checked, refusal
from tests.shared.paths import ROOT

pytest.importorskip("flint", reason="python-flint is not installed")
from mechdae.parts.proof.checker import IN_SPACE, mechanism_of
from mechdae.parts.proof.checker.counts import Count
from mechdae.parts.proof.write import certificate_of

COUNTED = {
    "double-wishbone": (4, 4),
    "double-cardan": (8, 8),
    "screw-press": (1, 1),
    "six-axis-arm": (8, 8),
    "seven-r": (6, 16),
    "stewart-gough": (40, 40),
}
"""Real and complex poses: a ball on a circle and one on a sphere 2 x 2; three pairs of signs;
linear; an arm whose wrist axes meet 4 x 2 (Pieper 1968); a ring of seven hinges 16 (Primrose 1986);
Dietmaier's platform, whose 40 poses are all real (1998)."""

SLOW = ("seven-r", "stewart-gough")


@pytest.mark.parametrize("name", COUNTED)
def test_as_many_poses_as_theorems_tell(name: str, tmp_path: Path) -> None:
    content, (real, every) = certificate(name), COUNTED[name]
    assert (len(content["modes"]), len(content["complex"])) == (real, every)
    proved = checked(content, tmp_path)
    assert proved.startswith(f"{real} modes, and no others: of {every} complex poses, ")


@pytest.mark.parametrize("name", COUNTED)
def test_altered_certificates_are_refused_with_their_place(name: str, tmp_path: Path) -> None:
    """Each kind of alteration, and numbers by a millionth."""
    rng, content, refused = random.Random(3), certificate(name), 0
    for kind in ("mode", "complex") if name in SLOW else KINDS:
        if kind == "label" and len({str(mode["signs"]) for mode in content["modes"]}) < 2:
            continue
        other, what = alter(content, kind, rng)
        if what and not (kind == "bound" and not content["modes"][0]["points"]):
            assert refusal(other, tmp_path), (kind, what)
            refused += 1
    assert refused > 1


def test_modes_without_bounds_tell_no_places() -> None:
    """Five of Dietmaier's 40 modes are not certified in float64: that they are there is."""
    silent = [mode for mode in certificate("stewart-gough")["modes"] if not mode["bound"]]
    assert len(silent) == sum(md.solve("stewart-gough", "modes").status != "ok") > 0
    assert not any(mode["points"] or mode["orientations"] for mode in silent)


def test_platforms_with_fewer_real_modes(tmp_path: Path) -> None:
    """40 complex poses whatever the lengths; with this one 6 are real."""
    text = (ROOT / "problems" / "stewart-gough.toml").read_text(encoding="utf-8")
    text = re.sub(r"\[\[expected\]\].*", "", text, flags=re.DOTALL)
    other = text.replace('"platform.P1"], length = 1 }', '"platform.P1"], length = 1.2 }')
    assert other != text
    (tmp_path / "platform.toml").write_text(other, encoding="utf-8")
    own = md.load(str(tmp_path / "platform.toml"))
    found = certificate_of(own, "modes")
    assert len(found["complex"]) == 40
    assert len(found["modes"]) == len(md.solve(own, "modes").status) == 6


def test_theorems_ask_for_what_they_say() -> None:
    """Groups that are like those of a theorem have another count, or none."""

    def counted(name: str, change: Any) -> int:
        content = certificate(name)
        change(content["mechanism"])
        m = mechanism_of(content["mechanism"], square=False)
        return Count(m, content["groups"], IN_SPACE).most

    def apart(mechanism: Any) -> None:  # the axes do not meet in a point
        mechanism["bodies"]["roll"]["V"] = ["1/100", "0", "0"]
        mechanism["joints"]["J5"]["first"] = "roll.V"

    def beside(mechanism: Any) -> None:  # the cross is not on the shaft's axis
        mechanism["bodies"]["output"]["Q"] = ["1/100", "0", "0"]
        mechanism["joints"]["V"]["second"] = "output.Q"

    def held(mechanism: Any) -> None:  # a bar holds the link that its hinge lets turn
        mechanism["joints"]["steer_ball"]["first"] = "upper.B"

    assert counted("double-wishbone", lambda mechanism: None) == 4
    assert counted("double-wishbone", held) == 0
    assert counted("six-axis-arm", lambda mechanism: None) == 8
    assert counted("six-axis-arm", apart) == 16
    assert counted("double-cardan", lambda mechanism: None) == 8
    assert counted("double-cardan", beside) == 0
