"""Random spatial vector loops, alone and beside bodies: poses that are `ok` against closures.

python -m tests.attack.spatial_vectors --sets 250 --most 20 --out FILE

As `spatial_poses`, with which it shares its options and counts: one to three loops of vectors of
which lengths, elevations and azimuths are unknown, bodies on joints and plates that vectors hold.
"""

from __future__ import annotations

import collections
from functools import partial
from typing import Any

import numpy as np

from tests.attack.spatial_poses import POSES, REACH, Reported, run
from tests.attack.spatial_poses import judged as judge
from tests.attack.vector_sets import draw
from tests.attack.vector_structures import structure
from tests.reference.vector_nets import WORDS

COUNTS = ("mechanisms", "ok", "tracked", "closed", "blurred", "wrong", "turned wrong", "refused")
HALVES = 2 * 3**0.5
"""How far the ends of a vector together may be off at most, by the bound of their coordinates."""


class ReportedVectors(Reported):
    """What results say, with the coordinates of vectors and the points between them."""

    def __init__(self, drawn: Any, results: list[Any], which: list[int]) -> None:
        super().__init__(drawn, results, which)
        own, found = [results[i] for i in which], drawn.structure
        unit = self.unit[:, None]
        self.triples = {
            (i, word): np.array([r.joints[f"v{i}"][word] for r in own])
            / (unit if word == "length" else 1.0)
            for i, arrow in enumerate(drawn.loops.arrows)
            for word in arrow.unknown
        }
        self.nodes = {}
        for i, place in enumerate(found.places):
            name = "" if place.owners else found.point(i)
            if name in own[0].points:
                places = np.array([r.points[name].position for r in own])
                self.nodes[i] = places / unit[..., None]

    def state(self, m: Any, sets: Any) -> tuple[Any, Any]:
        c, spins = super().state(m, sets)
        loops = self.drawn.loops
        for (i, word), values in self.triples.items():
            column = loops.column((len(loops.pairs) + i, loops.arrows[i].unknown.index(word)))
            if column != loops.driven:
                c[:, column] = values[sets, m]
        return c, spins

    def errors(self, net: Any, m: Any, sets: Any) -> tuple[Any, Any]:
        """Return how far points, lengths and the heads by the angles are off, and bodies."""
        far, off = super().errors(net.bodies, m, sets) if self.points else (0.0, 0.0)
        worst = [np.broadcast_to(far, len(sets))]
        for i, places in self.nodes.items():
            worst.append(np.abs(places[sets, m] - net.points[i]).max(axis=1))
        loops = self.drawn.loops.chosen(np.array(self.which)[sets])
        for (i, word), values in self.triples.items():
            exact = dict(zip(WORDS, loops.triple(i, net.values), strict=True))
            error = np.abs(values[sets, m] - exact[word])
            if word != "length":  # no bound of its own: by what it moves the head
                error *= np.abs(exact["length"]) / HALVES
            if word == "azimuth":
                error *= np.abs(np.cos(exact["elevation"]))
            worst.append(error)
        return np.max(worst, axis=0), np.broadcast_to(off, len(sets))


def judged(
    drawn: Any, rng: Any, poses: int = POSES, reach: float = REACH
) -> collections.Counter[str]:
    """Return counts as `spatial_poses.judged` does."""
    return judge(drawn, rng, poses, reach, ReportedVectors)


def by_kind(done: list[dict[str, Any]]) -> dict[str, dict[str, int]]:
    """Return structures, mechanisms and poses by what is told of them, of each kind."""
    return {word: _counted([one for one in done if holds(one)]) for word, holds in KINDS.items()}


def _kind(word: str, one: dict[str, Any]) -> bool:
    return bool(one["name"].startswith(word))


def _driven(words: tuple[str, ...], one: dict[str, Any]) -> bool:
    return one["driven"] in words


def _marked(mark: str, one: dict[str, Any]) -> bool:
    return mark in one["name"].split(":")[1]


def _loops(count: str, one: dict[str, Any]) -> bool:
    return one["name"].split()[1].startswith(f"{count}:") and one["name"].startswith("loops")


KINDS = {
    "one loop": partial(_loops, "1"),
    "two loops": partial(_loops, "2"),
    "three loops": partial(_loops, "3"),
    "beside bodies": partial(_kind, "bodies"),
    "plates on vectors": partial(_kind, "plate"),
    "bars": partial(_marked, "="),
    "balls at nodes": partial(_marked, "o"),
    "driven lengths": partial(_driven, ("length",)),
    "driven elevations": partial(_driven, ("elevation",)),
    "driven azimuths": partial(_driven, ("azimuth",)),
    "driven joints": partial(_driven, ("angle", "angle2", "slide", "x", "y")),
}
"""What the rows of the table hold, by names of structures and drivers."""


def _counted(own: list[dict[str, Any]]) -> dict[str, int]:
    return {"structures": len(own)} | {
        count: sum(one.get(count, 0) for one in own) for count in COUNTS
    }


def main() -> None:
    run(str(__doc__), structure, draw, judged, by_kind)


if __name__ == "__main__":
    main()
