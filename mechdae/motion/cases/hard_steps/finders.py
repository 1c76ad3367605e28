"""What finds the obstacles of a path, and what leads past them: made when it is asked for."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

from mechdae.motion.cases.hard_steps.crossings.across_change_point import Builder
from mechdae.motion.cases.hard_steps.crossings.change_points import CrossingFinder
from mechdae.motion.cases.hard_steps.fold_approach import FoldApproach
from mechdae.motion.continuation.any_path import AnyPath
from mechdae.motion.continuation.limit_positions import LimitFinder
from mechdae.motion.continuation.series_steps import Expansion
from mechdae.types import Floats


class Finders:
    """The finders of one path; `step` leads it from one node to the next."""

    def __init__(self, path: AnyPath, step: Callable[..., tuple[Floats, ...]]) -> None:
        self.path: AnyPath = path
        self.step: Callable[..., tuple[Floats, ...]] = step

    @cached_property
    def patience(self) -> float:
        """How much smaller steps become in space before one around a power series is tried.

        That costs as much as five hundred others there, and is as long as a hundred of them.
        """
        spatial = any(graph.reaches is not None for graph in self.path.graphs.blocks)
        return 1 / 64 if spatial else 1.0

    @cached_property
    def crossings(self) -> CrossingFinder:
        """What finds change points."""
        return CrossingFinder(
            self.path.graphs, self.path.constants, self.path.motion, self.path.largest
        )

    @cached_property
    def limits(self) -> LimitFinder:
        """What finds limit positions."""
        return LimitFinder(
            self.path.graphs,
            self.path.whole,
            self.path.constants,
            self.path.drivers,
            self.path.unit,
        )

    @cached_property
    def folds(self) -> FoldApproach:
        """What leads into a limit position."""
        return FoldApproach(self.path.graphs, self.path.constants, self.limits, self.path.motion)

    @cached_property
    def bridges(self) -> Builder:
        """What leads across a change point."""
        return Builder(self.crossings, self.step, self.path.constants, self.limits.weights)

    @cached_property
    def expansion(self) -> Expansion:
        """What proves steps around power series."""
        sizes = self.path.graphs.scene.unknowns.sizes(self.path.constants.scale)
        return Expansion(self.path.graphs, self.path.constants, sizes)
