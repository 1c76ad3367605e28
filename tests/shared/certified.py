"""Certificates of short tasks of all kinds, each written once in a process, and their check."""

from __future__ import annotations

import functools
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import mechdae as md
from mechdae.errors import SolveError
from tests.shared.paths import ROOT

CASES: dict[str, tuple[str, str, int | tuple[float, ...] | None]] = {
    "limits": ("four-bar-double-rocker", "window", 7),
    "branches": ("gorshkov-seven-link", "pose", None),
    "gears": ("planetary-gear-train", "turn", 5),
    "slides": ("scotch-yoke", "turn", 5),
    "laws": ("pantograph", "poses", None),
    "linear": ("differential", "line", 3),
    "rest": ("oscillating-cylinder", "start", 5),
    "modes": ("gorshkov-seven-link", "modes", None),
    "platform": ("triad-six-modes", "modes", None),
    "curve": ("double-watt", "modes", None),
    "geared": ("geared-five-bar", "modes", None),
    "tip": ("five-bar-robot", "postures", None),
    "beam": ("five-crank-parallelogram", "turn", 5),
    "rod": ("parallelogram-three-cranks", "turn", 5),
    "rods": ("parallelogram-three-cranks", "modes", None),
    "folding": ("folding-slider-crank", "turn", (1.3, math.pi / 2, 1.571, 1.9)),
    "kite": ("kite", "turn", (-0.3, 0.0, 1e-3, 0.3)),
    "anti": ("change-point-parallelogram", "anti_turn", (2.9, math.pi, 3.142, 3.3)),
    "cam": ("cam-roller-follower", "turn", (0.0, 0.1)),
    "lobes": ("hypocycloid-drive", "turns", (0.0, 0.1)),
    "contacts": ("cam-roller-follower", "modes", None),
    "pin": ("hypocycloid-drive", "modes", None),
    "seals": ("wankel-rotor", "modes", None),
    "space": ("rssr", "turn", (0.3, 0.5)),
    "spinning": (str(ROOT / "tests/data/spatial/cylinder-between-two-balls.toml"), "move", 3),
    "superfluous": ("cardan-joint", "turn", (0.3, 0.5)),
    "legs": ("delta-robot", "path", None),
    "spatial modes": ("cardan-joint", "modes", None),
    "spatial vectors": ("vector-modules-spatial", "l_a_b", None),
    "turns": ("bennett", "modes", None),
}
"""Problem, task, and how many poses of it, or where they are."""


@functools.cache
def _text(word: str) -> str:
    from mechdae.parts.proof import as_json
    from mechdae.parts.proof.write import certificate_of

    if word not in CASES:
        return as_json(certificate_of(md.load(word), "modes"))
    name, task, poses = CASES[word]
    problem = md.load(name)
    if poses:
        sweep = problem.tasks[task]
        assert isinstance(sweep, md.Sweep)
        if isinstance(poses, tuple):
            assert sweep.driver is not None
            driver = md.Driver(sweep.driver.coordinate, at=poses)
            sweep = replace(sweep, driver=driver, poses=None)
        else:
            sweep = replace(sweep, poses=poses)
        problem = problem.with_task(task, sweep)
    return as_json(certificate_of(problem, task))


def certificate(word: str) -> dict[str, Any]:
    """Return a certificate of `CASES`, or of the modes of a predefined problem; unchecked."""
    content: dict[str, Any] = json.loads(_text(word))
    return content


def checked(content: Any, folder: Path) -> str:
    """Return what is proved by a certificate."""
    path = folder / "c.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    return md.check_certificate(path)


def refusal(content: Any, folder: Path) -> str:
    """Return place and reason with which a certificate is refused."""
    with pytest.raises(SolveError, match="refused") as refused:
        print(checked(content, folder))
    assert refused.value.where
    return f"{refused.value.where} {refused.value}"
