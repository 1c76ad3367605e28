"""Mistakes planted in spatial mechanisms; poses of random structures must show each.

python -m tests.attack.spatial_mutants
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from mechdae.equations.tree import closures
from mechdae.motion.kinematics.prepared import SHAPES
from tests.attack import (
    spatial_poses,
    spatial_structures,
    spatial_vectors,
    vector_sets,
    vector_structures,
)
from tests.attack.mutants import divided
from tests.shared.planting import Slip, plant

SEED, SETS, POSES = 1, 5, 3
PAIRS = (spatial_structures.structure, spatial_structures.draw, spatial_poses.judged)
VECTORS = (vector_structures.structure, vector_sets.draw, spatial_vectors.judged)


@dataclass(frozen=True)
class Mutant:
    """A mistake and the number of the structure on which it is tried, of those of a kind."""

    number: int
    plant: Callable[[pytest.MonkeyPatch], None]
    wheels: bool = False
    kind: tuple[Callable[..., Any], ...] = PAIRS


def slip(place: str, right: str, wrong: str) -> Callable[[pytest.MonkeyPatch], None]:
    """Return what plants a slip of the pen."""
    return partial(plant, Slip(place, right, wrong, float, ""))


def longer_bar(patch: pytest.MonkeyPatch) -> None:
    def rows(cut: Any) -> Any:
        return closures.at_distance(replace(cut, length=1.000000001 * cut.length))

    patch.setitem(closures.ROWS, "distance", (rows,))


MUTANTS = {
    "bounds divided by 100 000": Mutant(2, partial(divided, divisor=1e5)),
    "a bar longer by a billionth": Mutant(2, longer_bar),
    "a pitch off by a billionth": Mutant(
        1, slip("equations.tree.tree_model", "pitch / (2 * ca.pi)", "pitch / (2.000000002 * ca.pi)")
    ),
    "a ratio off by a billionth": Mutant(
        9, slip("equations.tree.teeth", 'number("ratio") * second',
                '1.000000001 * number("ratio") * second'),
    ),
    "angles of wheels from the wheel to its carrier": Mutant(
        13, slip("equations.tree.teeth", "b.sense * value", "value"), wheels=True
    ),
    "a direction not quite of length 1": Mutant(
        0, slip("equations.tree.skeleton", "a = a / ca.norm_2(a)",
            "a = 1.000000001 * a / ca.norm_2(a)")
    ),
    "bounds of vectors divided by 100 000": Mutant(
        0, partial(divided, divisor=1e5), kind=VECTORS
    ),
    "an elevation with the other sign": Mutant(
        0, slip("equations.tree.spatial_frames", "length * ca.sin(e)", "-length * ca.sin(e)"),
        kind=VECTORS,
    ),
    "a vector longer by a billionth": Mutant(
        0, slip("equations.tree.spatial_frames", "level = length",
            "length *= 1.000000001; level = length"),
        kind=VECTORS,
    ),
}  # fmt: skip


def told(mutant: Mutant, patch: pytest.MonkeyPatch, planted: bool = True) -> int:
    """Return how many poses are wrong with a mistake, or without."""
    rng = np.random.default_rng((SEED, mutant.number))
    structure, draw, judged = mutant.kind
    drawn = draw(structure(rng, mutant.wheels) if mutant.wheels else structure(rng), rng, SETS)
    SHAPES.clear()
    if planted:
        mutant.plant(patch)
    try:
        words = judged(drawn, rng, POSES)
    finally:
        SHAPES.clear()
    return words["wrong"] + words["turned wrong"]


def main() -> None:
    for name, mutant in MUTANTS.items():
        with pytest.MonkeyPatch.context() as patch:
            without = told(mutant, patch, planted=False)
            print(f"{name}: {without} wrong without, {told(mutant, patch)} with", flush=True)


if __name__ == "__main__":
    main()
