"""A block that is a module of a vector loop in space: all its solutions in closed form."""

from __future__ import annotations

from itertools import permutations
from typing import Any

import numpy as np

from mechdae.equations.tree.spatial_frames import WORDS
from mechdae.motion.assembly.elimination import BlockSolver
from mechdae.motion.assembly.other_forms import Solutions
from mechdae.motion.modules.catalogue import MODULES
from mechdae.motion.modules.solutions import solve_module
from mechdae.types import Floats, Unknowns

LETTERS = dict(zip(WORDS, "lab", strict=True))
CLOSED = 1e-9
"""Largest residual of a solution before it is polished, by the size of the loop."""
TRIAL = (0.37, 1.91)
"""Values of an unknown that tell in which sense its vector is run."""


def of_loop(
    solver: BlockSolver, z: Unknowns, u: Floats, known: dict[tuple[str, str], float]
) -> Solutions | None:
    """Return all solutions of a block that is a module, None where it is none or not surely all.

    The block's own equations tell the senses of the vectors and their sum, and check the solutions.

    Parameters
    ----------
    solver, z, u
        The block, the earlier unknowns, the drivers.
    known
        Lengths, elevations and azimuths (vector, word) that are no unknowns of the block.
    """
    graph = solver.graph
    scene = solver.scene
    keys = [scene.unknowns[i].key for i in graph.own]
    joints = scene.model.mechanism.joints
    if graph.size != 3 or graph.rows != 3 or graph.redundant:
        return None
    if not all(name in joints and joints[name].pointer for name, _ in keys):
        return None
    letters: dict[str, str] = {}
    for word in WORDS:
        for name, other in keys:
            if other == word:
                letters[name] = letters.get(name, "") + LETTERS[word]
    order = next((o for o in permutations(letters) if _name(letters, o) in MODULES), None)
    if order is None or MODULES[_name(letters, order)].singular:
        return None

    def rows(x: Unknowns) -> Floats:
        return np.array(graph.function(x, z, u, solver.p)).ravel()

    def vector(name: str, x: Unknowns) -> Any:
        at = dict(zip(keys, x, strict=True))
        length, e, a = (at.get((name, w), known.get((name, w), np.nan)) for w in WORDS)
        return length * np.array([np.cos(e) * np.cos(a), np.sin(e), np.cos(e) * np.sin(a)])

    first = np.full(3, TRIAL[0])
    signs, here = {}, rows(first)
    for name in order:
        second = np.array([TRIAL[owner == name] for owner, _ in keys])
        change, moved = rows(second) - here, vector(name, second) - vector(name, first)
        signs[name] = 1.0 if change @ moved > 0 else -1.0
        if not np.abs(change - signs[name] * moved).max() <= 1e-9 * np.abs(moved).max():
            return None
    total = sum(signs[name] * vector(name, first) for name in order) - here
    given = [
        {
            word: known[name, word] * (signs[name] if word == "length" else 1.0)
            for word in WORDS
            if (name, word) not in keys
        }
        for name in order
    ]
    found = solve_module(_name(letters, order), given, total)
    if not found.sure[0] or not found.count[0]:
        return None
    x = np.empty((int(found.count[0]), 3))
    for position, name in enumerate(order, start=1):
        value = {
            word: found.unknowns[f"{word}{position}"][0, : len(x)]
            for word in WORDS
            if (name, word) in keys
        }
        for word, values in _turned(value, signs[name]).items():
            x[:, keys.index((name, word))] = values
    size = np.abs(total).max() + max(np.abs(vector(n, row)).max() for row in x for n in order)
    if max(np.abs(rows(row)).max() for row in x) > CLOSED * size:
        return None
    return Solutions(x, True)


def _name(letters: dict[str, str], order: tuple[str, ...]) -> str:
    return "-".join(letters[name] for name in order)


def _turned(value: dict[str, Floats], sign: float) -> dict[str, Floats]:
    """Return unknowns of a vector that was run in a sense, by the usual one of equal triples."""
    if "length" not in value:
        return value
    length = sign * value["length"]
    if "elevation" not in value:
        return {**value, "length": length}
    back = length < 0
    e = value["elevation"]
    if "azimuth" not in value:
        return {"length": np.abs(length), "elevation": np.where(back, e + np.pi, e)}
    a = value["azimuth"]
    return {
        "length": np.abs(length),
        "elevation": np.where(back, -e, e),
        "azimuth": np.where(back, a + np.pi, a),
    }
