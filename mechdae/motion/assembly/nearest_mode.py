"""The assembly mode nearest to the sketch: that of the whole mechanism, not of each group.

What the sketch says is compared as soon as it is known: an angle with its body, the slide or
angle of a joint with the later one of its bodies. The squares of the gaps add up from group to
group, so the mode of the least sum is found by always going on from the best one begun; groups
that have nothing to do with each other are looked at apart.
"""

from __future__ import annotations

import heapq
import itertools
import math
from dataclasses import field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinates import NamedCoordinate, coordinate
from mechdae.describe.mechanism import GROUND
from mechdae.equations.groups import Group
from mechdae.equations.reduction import Scene
from mechdae.errors import UnavailableError
from mechdae.kernels.run.functions import Local, local
from mechdae.motion.assembly.closure import NoPose
from mechdae.motion.assembly.mode_labels import Assembling
from mechdae.motion.setup.scales import driver_size
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Sym, Unknowns

if TYPE_CHECKING:
    from mechdae.motion.assembly.turns.undecided import Undecided

TIE = 1e-6
"""Difference of two distances over the distance, at which a sketch does not tell modes apart."""
ROUNDING = 1e-9
"""The same for sketches that are a mode but for rounding [rad, sizes of the mechanism]."""
MOST_BEGUN = 2000
"""Begun modes that are gone on from before the search ends with the best of them."""
MOST_TIED = 32
MOST_TURNED = 512
"""The same in space, where each leg of a platform may stand turned by half a turn."""


@dataclass(frozen=True, eq=False)
class SketchNumber:
    """A number of the sketch; ``stage`` is the place of the group it is known with.

    ``size`` is its unit, ``turns`` tells that a whole turn of it makes no difference.
    """

    scene: Scene
    coordinate: NamedCoordinate
    wanted: float
    stage: int
    size: float
    turns: bool

    @property
    def value(self) -> Local:
        """The coordinate as a function of a pose."""
        return local(self.scene, self.coordinate.text, self.expression)

    def expression(self) -> Sym:
        """Return the coordinate over q."""
        return self.scene.model.coordinate(self.coordinate)

    def off(self, value: float, unwound: bool = False) -> float:
        """Return how far a value is from that of the sketch, whole turns too if `unwound`."""
        gap = (value - self.wanted) / self.size
        return math.remainder(gap, 2 * math.pi) if self.turns and not unwound else gap

    def gap(self, x: Unknowns, u: Floats, p: Floats, unwound: bool = False) -> float:
        """Return how far it is from its value at a pose, whole turns too if `unwound`."""
        return self.off(self.value(x, u, p).item(), unwound)


class SketchOfGroup:
    """The numbers of the sketch that are known with one group, evaluated at once."""

    def __init__(self, numbers: list[SketchNumber]) -> None:
        self.numbers = numbers
        key = tuple(number.coordinate.text for number in numbers)
        self.values: Local = local(
            numbers[0].scene, key, lambda: ca.vertcat(*[n.expression() for n in numbers])
        )

    def square(self, x: Unknowns, u: Floats, p: Floats) -> float:
        """Return the sum of the squares of the gaps at a pose."""
        values = self.values(x, u, p).ravel().tolist()
        gaps = (number.off(value) for number, value in zip(self.numbers, values, strict=True))
        return sum(gap**2 for gap in gaps)


@dataclass
class Nearest:
    """The pose nearest to the sketch, or the group that failed on the way to it.

    ``doubtful`` are groups whose mode the sketch does not tell, ``tied`` their places and the poses
    between which it does not; ``turned`` joints at which the least angles were taken; ``ended``
    tells that the search was ended before all were compared.
    """

    x: Floats
    failure: NoPose | None = None
    doubtful: list[Group] = field(default_factory=list)
    tied: list[tuple[list[int], list[Any]]] = field(default_factory=list)
    turned: list[str] = field(default_factory=list)
    ended: bool = False


class Sketched:
    """What the sketch says about the groups of a scene, and the modes nearest to it.

    Parameters
    ----------
    assembler
        Gives all poses of one group.
    """

    def __init__(self, assembler: Assembling) -> None:
        self.assembler: Assembling = assembler
        self.scene: Scene = assembler.scene
        self.groups: list[Group] = self.scene.groups
        self.stage: dict[str, int] = {
            body: k for k, group in enumerate(self.groups) for body in group.bodies
        }
        mechanism = self.scene.model.mechanism
        angles = [(coordinate(mechanism, f"{b}.angle"), v) for b, v in assembler.sketch.items()]
        entries = [self.entry(c, value) for c, value in (*angles, *assembler.places.items())]
        self.entries: list[SketchNumber] = [entry for entry in entries if entry is not None]
        of_stage: dict[int, list[SketchNumber]] = {}
        for entry in self.entries:
            of_stage.setdefault(entry.stage, []).append(entry)
        self._at_stage = {stage: SketchOfGroup(numbers) for stage, numbers in of_stage.items()}
        names = tuple(entry.coordinate.text for entry in self.entries)
        self._known_parts: dict[tuple[int, ...], list[list[int]]] = self.scene.cache(
            ("parts of a sketch", names), dict
        )
        self.parts: list[list[int]] = self._parts(list(range(len(self.groups))))
        self.ended: bool = False
        """Whether the last search ended before all modes were compared."""
        self.turned: list[str] = []
        """Joints whose angles the sketch does not tell, and no point: the least were taken."""

    def entry(self, c: NamedCoordinate, wanted: float) -> SketchNumber | None:
        """Return an entry of the sketch, None where it tells of bodies that are not solved for."""
        bodies = [body for body in self.bodies(c) if body != GROUND]
        if not bodies or not all(body in self.stage for body in bodies):
            return None
        model = self.scene.model
        joint = model.mechanism.joints.get(c.part)
        winds = joint is not None and joint.winds
        turns = (c.is_angle and not winds) or (c.on_curve and model.contacts[c.part].closed)
        size = driver_size(model, c, self.assembler.size)
        stage = max(self.stage[body] for body in bodies)
        return SketchNumber(self.scene, c, wanted, stage, size, turns)

    def bodies(self, c: NamedCoordinate) -> tuple[str, ...]:
        """Return the bodies that a coordinate belongs to."""
        joints = self.scene.model.mechanism.joints
        own_joint = c.kind not in ("body angle", "point")
        return joints[c.part].bodies if own_joint else (c.part,)

    def _parts(self, stages: list[int]) -> list[list[int]]:
        """Return sets of groups that depend on each other by their poses or by the sketch.

        `stages` are those looked at, others are solved.
        """
        known = self._known_parts.get(tuple(stages))
        if known is not None:
            return known
        at = {group.index: k for k, group in enumerate(self.groups)}
        block = {i: at[graph.group] for graph in self.scene.blocks for i in graph.x}
        leader = {k: k for k in stages}

        def of(k: int) -> int:
            while leader[k] != k:
                k = leader[k]
            return k

        def unite(k: int, unknowns: list[int]) -> None:
            for stage in {block[i] for i in unknowns} & leader.keys():
                if k in leader:
                    leader[of(stage)] = of(k)

        for part in self.scene.blocks:
            unite(at[part.group], list(part.uses))
        for check in self.scene.checks:
            unite(at[check.group], self.scene.held(check.residual)[0])
        for stage, sketch in self._at_stage.items():
            unite(stage, sketch.values.held[0])
        found: dict[int, list[int]] = {}
        for k in stages:
            found.setdefault(of(k), []).append(k)
        self._known_parts[tuple(stages)] = list(found.values())
        return self._known_parts[tuple(stages)]

    # -- search ----------------------------------------------------------------------------

    def nearest(self, u: Floats) -> Nearest:
        """Return the mode nearest to the sketch at driver values `u`.

        Where the sketch is a pose but for rounding, others are looked for only if the mechanism
        does not assemble on it.
        """
        for drawn in (True, False):
            result = Nearest(np.zeros(self.assembler.graphs.nx))
            self.assembler.shortened = False
            for part in self.parts:
                self._part(part, result, u, drawn)
                if result.failure is not None:
                    break
            if result.failure is None or not self.assembler.shortened:
                break
        self.ended, self.turned = result.ended, list(dict.fromkeys(result.turned))
        return result

    def _part(self, part: list[int], result: Nearest, u: Floats, drawn: bool) -> None:
        """Continue `result` by the nearest mode of groups that depend on each other."""
        order = itertools.count()
        # the first two tell what is next
        begun = [(0.0, 0.0, next(order), 0.0, 0, Nearest(result.x))]
        found: list[tuple[float, Nearest]] = []
        deepest, taken = -1, 0
        failed: NoPose | None = None
        at = result.x
        most = MOST_TIED if self.scene.model.mechanism.dimension == 2 else MOST_TURNED
        while begun and taken < 2 * MOST_BEGUN:
            *_, cost, done, mode = heapq.heappop(begun)
            if found and told_apart(cost, found[0][0]):
                break
            if done == len(part):
                found.append((cost, mode))
                if len(found) == most or result.ended:
                    break
                continue
            ahead, failure = self._ahead(part[done:], mode, u, drawn)
            if failure is not None and done > deepest:
                deepest, failed, at = done, failure, mode.x
            for more, gone, pose in ahead:
                left, total = float(len(part) - done - gone), cost + more
                key = (left, total) if result.ended else (total, left)
                heapq.heappush(begun, (*key, next(order), total, done + gone, pose))
            taken += 1
            if taken == MOST_BEGUN:  # from here on the deepest first
                result.ended = True
                begun = [(mode[1], mode[0], *mode[2:]) for mode in begun]
                heapq.heapify(begun)
        if found:
            self._choose(part, [mode for _, mode in found], result, u)
        elif begun:
            raise UnavailableError(
                f"no mode near the sketch is found: {taken} were begun and none came to its end",
                hint="sketch more bodies, or name the mode",
            )
        else:
            result.failure, result.x = failed, at

    def _ahead(
        self, rest: list[int], begun: Nearest, u: Floats, drawn: bool
    ) -> tuple[list[tuple[float, int, Nearest]], NoPose | None]:
        """Return how a begun mode goes on: squares of its distance, groups done, the mode.

        Groups that what is done leaves without anything in common are solved each for itself.
        """
        apart = self._parts(rest)
        if len(apart) > 1:
            whole = replace(
                begun, doubtful=[*begun.doubtful], tied=[*begun.tied], turned=[*begun.turned]
            )
            for part in apart:
                self._part(part, whole, u, drawn)
                if whole.failure is not None:
                    return [], whole.failure
            square = sum(self._square(stage, whole.x, u) for stage in rest)
            return [(square, len(rest), whole)], None
        poses, _, failure = self.assembler.candidates(
            self.groups[rest[0]], begun.x, u, nearby=True, drawn=drawn
        )
        ahead = [(self._square(rest[0], x, u), 1, replace(begun, x=x)) for x in poses]
        return ahead, failure

    def _choose(self, part: list[int], found: list[Nearest], result: Nearest, u: Floats) -> None:
        """Take the nearest of modes that the sketch does not tell apart, if one is meant."""
        near: list[Nearest] = []
        for mode in found:  # a group may give one pose twice
            if not any(np.array_equal(mode.x, other.x) for other in near):
                near.append(mode)
        if len(near) > 1:  # the same but for whole turns, which a gear tells apart
            whole = [self._unwound(part, mode.x, u) for mode in near]
            least = min(whole)
            by_turns = sorted(zip(whole, range(len(near)), strict=True))
            near = [near[k] for far, k in by_turns if not told_apart(far**2, least**2)]
        poses = [mode.x for mode in near]
        turned: list[str] = []
        if len(poses) > 1:
            poses, turned = self.undecided.meant(part, poses, u)
        chosen = next(mode for mode in near if mode.x is poses[0])
        result.x, result.ended = chosen.x, result.ended or chosen.ended
        result.turned += [*chosen.turned, *turned]
        result.doubtful += chosen.doubtful
        result.tied += chosen.tied
        if len(poses) > 1:
            result.doubtful.append(self.undecided.first_to_differ(part, poses))
            result.tied.append((part, poses))

    def _square(self, stage: int, x: Unknowns, u: Floats) -> float:
        sketch = self._at_stage.get(stage)
        return sketch.square(x, u, self.assembler.p) if sketch is not None else 0.0

    def _unwound(self, part: list[int], x: Unknowns, u: Floats) -> float:
        """Return how far geared bodies are from the sketch, whole turns included [rad]."""
        geared = self.assembler.turns.whole.geared
        angles = [e for e in self.entries if e.stage in part and e.coordinate.kind == "body angle"]
        angles = [e for e in angles if e.coordinate.part in geared]
        return math.hypot(*[e.gap(x, u, self.assembler.p, True) for e in angles])

    @cached_property
    def undecided(self) -> Undecided:
        """What tells modes apart that are equally near."""
        from mechdae.motion.assembly.turns.undecided import Undecided

        return Undecided(self, TIE)

    def distance(self, group: Group, x: Unknowns, u: Floats) -> float:
        """Return how far what is known with a group is from the sketch [rad]."""
        return math.sqrt(self._square(self.stage[group.bodies[0]], x, u))


def told_apart(one: Floats | float, other: Floats | float) -> Booleans | bool:
    """Return whether a mode is farther from the sketch than another, by more than rounding."""
    far, near = np.sqrt(one), np.sqrt(other)
    return far - near > TIE * near + ROUNDING
