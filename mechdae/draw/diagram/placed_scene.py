"""What scenes of the plane and of space have in common."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from mechdae.describe.coordinates import NamedCoordinate
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.draw.primitives import Array
from mechdae.records import dataclass
from mechdae.results.status import UNREACHED

CLOSED = 1e-9
"""First and last pose are the same if no point is farther off than this share of the scale."""


@dataclass(frozen=True, kw_only=True)
class PlacedScene:
    """Placements of the bodies of a mechanism in n poses, in the plane or in space.

    Parameters
    ----------
    mechanism
        The mechanism drawn.
    numbers
        Values of its parameters and automatic names.
    status
        (n,) text.
    open
        Names of the joints that do not close: their links are drawn apart.
    way
        The same motion at more poses, of which the paths are.
    turn
        (n,) rad, the angle that the first moving driver gives; none where it gives a length.
    """

    mechanism: Mechanism
    numbers: Mapping[str, float]
    status: tuple[str, ...]
    open: frozenset[str] = frozenset()
    way: PlacedScene | None = None
    turn: Array | None = None

    @property
    def helpers(self) -> set[str]:
        """The bodies that are not drawn."""
        return set()

    @property
    @abstractmethod
    def placed(self) -> Collection[str]:
        """The bodies of which a pose is known, and the ground."""

    def local(self, reference: str) -> Array:
        """Return the coordinates of ``body.point`` in its body."""
        return np.array([self.numbers[f"{reference}.{axis}"] for axis in self.mechanism.axes])

    @abstractmethod
    def points(self, body: str) -> list[str]:
        """Return the references of the points of a body whose places are known."""

    @abstractmethod
    def track(self, reference: str) -> Array:
        """Return the positions of ``body.point`` in all poses, (n, 2) or (n, 3), read-only."""

    @abstractmethod
    def place(self, reference: str, pose: int) -> Array:
        """Return the position of ``body.point`` in one pose."""

    @abstractmethod
    def carried(self, body: str, local: Array, pose: int) -> Array:
        """Return where a place of a body's frame is; nan where that is not known."""

    @abstractmethod
    def shown(self, body: str, pose: int) -> bool:
        """Return whether the body has a placement in that pose."""

    @abstractmethod
    def known(self) -> Iterable[ArrayLike]:
        """Return in which poses (n,) bodies, or points, have a place."""

    @abstractmethod
    def directions(self) -> Iterator[Array]:
        """Yield the directions (n, ...) of bodies, the same after a whole turn."""

    @abstractmethod
    def series(self, entry: NamedCoordinate) -> Array:
        """Return a coordinate in all poses, (n,); nan where it is not known."""

    def has(self, joint: Joint, pose: int) -> bool:
        """Return whether both sides of a joint are shown."""
        return self.shown(joint.first_body, pose) and self.shown(joint.second_body, pose)

    def joints(self, pose: int) -> list[Joint]:
        """Return the joints that are shown, without open ones."""
        joints = self.mechanism.joints.values()
        return [each for each in joints if each.name not in self.open and self.has(each, pose)]

    def assembled(self) -> list[int]:
        """Return the poses that are assembled, and not beyond a stop."""
        there = ~np.isin(self.status, UNREACHED)
        return np.flatnonzero(np.all([there, *map(np.asarray, self.known())], axis=0)).tolist()

    def closes(self, run: Sequence[int]) -> bool:
        """Return whether a run of poses ends where it begins.

        Gears may return to another tooth: what counts is where points and directions are.
        """
        tracks = [self.track(ref) for body in self.mechanism.bodies for ref in self.points(body)]
        sized = [(track, self.mechanism.scale) for track in tracks]
        sized += [(turn, 1.0) for turn in self.directions()]
        return len(run) > 2 and all(
            float(np.abs(series[run[-1]] - series[run[0]]).max()) <= CLOSED * size
            for series, size in sized
        )

    @cached_property
    def paths(self) -> dict[str, Array]:
        """The paths of the points that move, by ``body.point``, nan where not assembled.

        Points that go together are there once. The path of a block on a fixed guide is the
        guide, and is left out.
        """
        if self.way is not None:
            return self.way.paths
        known, count = self.assembled(), len(self.status)
        points = [ref for body in self.mechanism.bodies for ref in self.points(body)]
        guided = [
            joint.second
            for joint in self.mechanism.joints.values()
            if joint.guide and joint.first_body == GROUND and joint.second in points
        ]
        result: dict[str, Array] = {}
        if len(known) < 2 or not points:
            return result
        # paths are compared where it costs little first
        every = np.array([self.track(key)[known] for key in [*guided, *points]])
        few = every[:, [0, len(known) // 3, -1]].reshape(len(every), -1)
        spread = np.ptp(every, axis=1).max(axis=1)
        least, seen = 1e-9 * float(spread.max()), list(range(len(guided)))
        for k, key in enumerate(points, len(guided)):
            same = 1e-6 * spread[k]
            alike = np.flatnonzero((np.abs(few[seen] - few[k]) <= same).all(axis=1))
            if spread[k] > least and not any(
                bool((np.abs(every[seen[j]] - every[k]) <= same).all()) for j in alike.tolist()
            ):
                seen.append(k)
                result[key] = np.full((count, every.shape[-1]), np.nan)
                result[key][known] = every[k]
        return result
