"""The space of designs: free parameters with bounds, the poses of a design in an NLP."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from itertools import product
from typing import Any

import casadi as ca
import numpy as np

from mechdae.describe.coordinate_kinds import KINDS, UNIT
from mechdae.describe.coordinates import coordinate
from mechdae.describe.joints.joint import LIMITS, Joint
from mechdae.describe.joints.limits import limited
from mechdae.describe.tasks.constraints import Box, RatioConstraint, TransmissionAngle
from mechdae.describe.tasks.synthesis import Demand
from mechdae.design.synthesis.fourbar.loops import FourBar, four_bar
from mechdae.design.synthesis.nlp import Nlp
from mechdae.design.synthesis.poses import FreePoses
from mechdae.equations.model import Model
from mechdae.equations.parameters import parameters_of
from mechdae.errors import InputError
from mechdae.kernels.run.functions import Batch
from mechdae.motion.measures.transmission import Dyad
from mechdae.records import dataclass
from mechdae.types import Booleans, Floats, Points, Sym, Unknowns

STOP = "limits of "
"""Begins the name of an asked value that is not negative between stops."""


def inside(model: Model, joints: list[Joint], size: float) -> dict[str, Sym]:
    """Return by name what is not negative where joints are within their limits.

    Angles count but for whole turns, unless the limits are a turn apart.
    """
    values, found = model.mechanism.values(), {}
    for joint in joints:
        c = coordinate(model.mechanism, f"{joint.name}.{joint.ranged}")
        value = model.coordinate(c)
        low, high = (model.numbers[f"{joint.name}.{end}"] for end in LIMITS)
        span = values[f"{joint.name}.{LIMITS[1]}"] - values[f"{joint.name}.{LIMITS[0]}"]
        if c.is_angle and span < 2 * np.pi:
            rows = ca.cos(value - (low + high) / 2) - ca.cos((high - low) / 2)
        else:
            rows = ca.vertcat(value - low, high - value) / (1.0 if c.is_angle else size)
        found[STOP + joint.name] = rows
    return found


SX = ca.SX
TURN = 2 * np.pi
WIDE = 40.0
"""Bound of angles [rad]: they are unwrapped, and nothing may run away."""
FAR = 100.0
"""The same for lengths among the unknowns, in sizes of the mechanism."""
BRANCH = 1e-6
"""Least |determinant| of a pose relative to its columns, sin(theta4 - theta3) of a four-bar."""
WELL = 1e-3
"""The same over a whole turn, between whose nodes nothing is asked."""
TURNS = 1e-6
"""Least slack of Grashof's inequalities, in sizes of the mechanism, where none is given."""
SAMPLES = 9
"""Places at which numbers are looked at, for their size."""
WATCHED = 4
"""Poses of a turn, beside its nodes, at which a transmission angle is least."""
CLASSES = ("crank-rocker", "drag-link")
"""Grashof's classes in which the driven link turns fully."""


@dataclass
class DesignSpace:
    """Free parameters and the poses of all designs.

    ``size`` [m] makes lengths dimensionless; `outside` tells that motions or equilibria are
    asked for, on which parameters may act that no pose depends on.
    """

    poses: FreePoses
    asked: Demand
    size: float
    outside: bool = False

    # -- free parameters -----------------------------------------------------------------------

    @cached_property
    def names(self) -> list[str]:
        """Free parameters, then those that are chosen."""
        return [*self.asked.free, *self.asked.choices]

    @cached_property
    def box(self) -> Points:
        """Bounds (nd, 2) of the free parameters."""
        return np.array(list(self.asked.free.values()), float).reshape(-1, 2)

    @cached_property
    def periodic(self) -> Booleans:
        """Which free parameters are angles (nd,): a whole turn of them changes nothing."""
        poses, n = self.poses, len(self.box)
        generator = np.random.default_rng(0)
        low, high = self.box.T
        found, still = np.ones(n, bool), np.ones(n, bool)
        for _ in range(2):
            d = np.concatenate([generator.uniform(low, high), self.middle[n:]])
            x = generator.uniform(-2, 2, poses.nx) * self.natural
            u = float(generator.uniform(0, 6))

            def parts(at: Floats, x: Unknowns = x, u: float = u) -> Floats:
                return np.concatenate([np.array(part).ravel() for part in poses.function(x, u, at)])

            middle = parts(d)
            unit = max(float(np.abs(middle).max(initial=0.0)), self.size)
            for k in range(n):
                moved = d.copy()
                moved[k] += TURN
                gap = np.abs(parts(moved) - middle).max(initial=0.0)
                found[k] &= bool(gap < 1e-9 * unit)
                moved[k] = d[k] + TURN / 3
                still[k] &= not (parts(moved) - middle).any()
        return found & ~still if self.outside else found

    @cached_property
    def samples(self) -> tuple[Points, Floats, Floats]:
        """Random unknowns (k, nx), driver values (k, 1) and parameters (k, nd), of no pose."""
        generator, (low, high), n = np.random.default_rng(0), self.box.T, len(self.box)
        d = np.tile(self.middle, (SAMPLES, 1))
        d[:, :n] = generator.uniform(low, high, (SAMPLES, n))
        x = generator.uniform(-2, 2, (SAMPLES, self.poses.nx)) * self.natural
        return x, generator.uniform(0, 6, (SAMPLES, 1)) * self.way, d

    @cached_property
    def scale(self) -> Floats:
        """Sizes of the free parameters, (nd,): one for angles, the mechanism's for lengths."""
        most = np.maximum(np.abs(self.box).max(axis=1), 1e-300)
        near = (most > 1e-3 * self.size) & (most < 1e4 * self.size)
        return np.where(self.periodic, 1.0, np.where(near, self.size, most))

    @property
    def choices(self) -> Iterator[Floats]:
        """All combinations of what is chosen, each (nc,)."""
        for values in product(*self.asked.choices.values()):
            yield np.array(values, float)

    @cached_property
    def middle(self) -> Floats:
        """The parameters of the file, within the bounds, then those that are chosen."""
        values = self.poses.mechanism.values()
        low, high = self.box.T
        free = np.clip([values[name] for name in self.asked.free], low, high)
        return np.concatenate([free, [values[name] for name in self.asked.choices]])

    def design(self, nlp: Nlp) -> Sym:
        """Add the free parameters and those that are chosen; return both."""
        low, high = self.box.T
        free = nlp.variable("d", len(low), low, high, self.scale)
        return ca.vertcat(free, nlp.parameter("choice", self.middle[len(low) :]))

    def over_free(self, expression: Sym, d: Sym) -> Sym:
        """Return an expression over p as one over the free parameters `d`."""
        p = parameters_of(self.poses.model, self.names, d)
        return ca.substitute(SX(expression), self.poses.model.p, p)

    def of_name(self, name: str, d: Sym) -> Any:
        """Return a parameter of the mechanism over the free ones."""
        place = self.poses.model.p_names.index(name)
        return parameters_of(self.poses.model, self.names, d)[place]

    @property
    def turned(self) -> bool:
        """Whether the driver is an angle, not a slide."""
        return bool(self.poses.scene.drivers[0].is_angle)

    @property
    def way(self) -> float:
        """One of the driver: a radian, or the size of the mechanism."""
        return 1.0 if self.turned else self.size

    # -- poses ---------------------------------------------------------------------------------

    @cached_property
    def turns(self) -> Booleans:
        """Which unknowns of a pose are angles (nx,)."""
        return self.poses.scene.unknowns.turns

    @cached_property
    def natural(self) -> Floats:
        """Sizes of the unknowns of a pose (nx,): one for angles and quaternions."""
        unknowns = self.poses.scene.unknowns
        return np.where(self.turns | unknowns.of_kind(UNIT), 1.0, self.size)

    def pose_variables(self, nlp: Nlp, name: str, count: int) -> Sym:
        """Add the unknowns of poses, (nx, count)."""
        bound = np.tile(np.where(self.turns, WIDE, FAR * self.natural), count)
        scale = np.tile(self.natural, count)
        x = nlp.variable(name, self.poses.nx * count, -bound, bound, scale)
        return ca.reshape(x, self.poses.nx, count)

    def at(self, nlp: Nlp, x: Sym, u: Sym, d: Sym, sigma: Sym) -> Sym:
        """Add closure and branch of a pose, and limits that hold at all; return asked values."""
        F, branch, values = self.poses.function(x, u, d)
        nlp.constrain("closure", F / self.units)
        nlp.constrain("branch", sigma * branch, BRANCH * self.poses.margins, np.inf)
        for pose in self.held_at_poses:
            sine = self.poses.sine(self.dyad(pose.between), branch, values, sigma)
            nlp.constrain("transmission", sine, np.sin(pose.min), np.inf)
        if self.asked.full_turn:
            return values
        self._boxes(nlp, values)
        return values

    @cached_property
    def units(self) -> Floats:
        """Sizes of the closure's rows, (nx,)."""
        units = [unit for block in self.poses.scene.blocks for unit in block.units]
        return np.array([self.size if unit == "m" else 1.0 for unit in units])

    @cached_property
    def rows_of_length(self) -> Booleans:
        """Which rows of the closure are lengths, (nx,)."""
        blocks = self.poses.scene.blocks
        return np.array([unit == "m" for block in blocks for unit in block.units], bool)

    # -- transmission angles -------------------------------------------------------------------

    @cached_property
    def held_at_poses(self) -> list[TransmissionAngle]:
        """Limits of transmission angles that hold at the poses of the goals."""
        every = self.asked.of(TransmissionAngle)
        return [angle for angle in every if angle.over == "goal" or not self.asked.full_turn]

    @cached_property
    def held_over_turn(self) -> list[TransmissionAngle]:
        """Limits of transmission angles that hold over the whole turn."""
        return [
            angle for angle in self.asked.of(TransmissionAngle) if angle not in self.held_at_poses
        ]

    def of_loop(self, dyad: Dyad) -> bool:
        """Whether a dyad closes the four-bar next to the driver: its extremes are known."""
        loop = self.loop
        return loop is not None and set(dyad.bodies) == {loop.coupler, loop.rocker}

    @cached_property
    def watched_limits(self) -> list[TransmissionAngle]:
        """Limits over the turn whose extremes have no closed form."""
        return [a for a in self.held_over_turn if not self.of_loop(self.dyad(a.between))]

    @cached_property
    def watched_dyads(self) -> list[Dyad]:
        return [self.dyad(limit.between) for limit in self.watched_limits]

    def dyad(self, bodies: tuple[str, ...], place: str = "") -> Dyad:
        """Return the dyad whose transmission angle is that between two bodies."""
        every = self.poses.dyads
        for dyad in every:
            if len(bodies) == 2 and set(bodies) == set(dyad.bodies):
                return dyad
        near = [
            dyad for dyad in every
            if set(bodies) & {b for name in dyad.group.joints
                              for b in self.poses.mechanism.joints[name].bodies}
        ]  # fmt: skip
        words = [f"{' and '.join(d.bodies)} (joint {d.joint})" for d in near or every]
        hint = f"the transmission angle is that between {', or '.join(words)}" if words else ""
        raise InputError(
            f"{' and '.join(bodies) or 'no body'}: no transmission angle belongs to them: it is "
            f"the angle in the joint between the two links of a dyad",
            where=place, hint=hint or "the mechanism has no dyad",
        )  # fmt: skip

    def _boxes(self, nlp: Nlp, values: Sym, around: tuple[Sym, Sym] | None = None) -> None:
        """Keep points in boxes and joints within limits; `around`: neighbours on a turn.

        A parabola through three nodes is at most an eighth of their second difference beyond the
        middle one.
        """
        held = [(f"box of {point}", point, np.transpose(box.bounds(self.poses.mechanism.axes)))
                for box in self.asked.of(Box) for point in box.points]  # fmt: skip
        held += [(name, name, np.array([0.0, np.inf])) for name in self.stops]
        for label, name, (low, high) in held:
            size = 1.0 if name in self.stops else self.size
            place = self.poses.part(values, name) / size
            if around is not None:
                last, after = (self.poses.part(beside, name) / size for beside in around)
                place = place - (last - 2 * place + after) / 8
            unit, si = (self.size, "m") if self._long(name) else (1.0, "")
            nlp.constrain(label, place, low / size, high / size, unit, si)

    def _long(self, name: str) -> bool:
        """Return whether a point, or what is not negative within limits, is a length."""
        joint = self.poses.mechanism.joints.get(name.removeprefix(STOP))
        return name not in self.stops or bool(joint and KINDS[joint.ranged].unit == "m")

    @property
    def stops(self) -> list[str]:
        """Names of what is not negative where joints are within their limits."""
        return [STOP + joint.name for joint in limited(self.poses.mechanism.joints)]

    # -- limits of the design ------------------------------------------------------------------

    @cached_property
    def loop(self) -> FourBar | None:
        """The four-bar next to the driver."""
        return four_bar(self.poses.scene)

    @cached_property
    def lengths(self) -> Batch:
        """(free) -> lengths (n, 4) of that four-bar, for many designs."""
        assert self.loop is not None
        d = SX.sym("d", len(self.names))
        lengths = ca.densify(self.over_free(self.loop.lengths, d))
        return Batch(ca.Function("lengths", [d], [lengths]), ())

    @property
    def single_loop(self) -> bool:
        """The whole scene is a four-bar, so that Grashof's class tells whether it turns."""
        return self.loop is not None and self.poses.nb == 1

    @property
    def kinds(self) -> tuple[str, ...]:
        """Classes that each have an NLP of their own."""
        return CLASSES if self.asked.full_turn and self.loop is not None else ("",)

    @property
    def turn_needed(self) -> bool:
        """Whether poses of a whole turn are part of the problem."""
        more = not self.single_loop or any((self.asked.of(Box), self.watched_limits, self.stops))
        return self.asked.full_turn and more

    def limits(self, nlp: Nlp, d: Sym, sigma: Sym, kind: str) -> None:
        """Add what the task demands of the design as a whole."""
        for ratio in self.asked.of(RatioConstraint):
            first, second = (self.of_name(name, d) for name in ratio.of)
            gap = (first - ratio.max * second) / self.size
            nlp.constrain("ratio", gap, -np.inf, 0.0, self.size, "m")
        for region in self.asked.regions:
            self._region(nlp, region, d)
        if not self.asked.full_turn:
            return
        if self.loop is not None:
            self._grashof(nlp, d, kind)
        if self.turn_needed:
            self._turned(nlp, d, sigma)

    def _region(self, nlp: Nlp, region: Any, d: Sym) -> None:
        x, y = ca.vertsplit(self.over_free(self.poses.model.point(region.point), d))
        if region.disc:
            a, b, r = region.disc
            gap = ((x - a) ** 2 + (y - b) ** 2) / r**2
            nlp.constrain(f"region of {region.point}", gap, -np.inf, 1.0)
            return
        corners = region.polygon
        for (a, b), (e, f) in zip(corners, [*corners[1:], corners[0]], strict=True):
            inside = ((e - a) * (y - b) - (f - b) * (x - a)) / np.hypot(e - a, f - b) / self.size
            nlp.constrain(f"region of {region.point}", inside, 0.0, np.inf, self.size, "m")

    def _grashof(self, nlp: Nlp, d: Sym, kind: str) -> None:
        """Add the inequalities of Grashof's class, by which the crank turns fully."""
        assert self.loop is not None
        r1, r2, r3, r4 = ca.vertsplit(self.over_free(self.loop.lengths, d))
        if kind == "crank-rocker":
            slack = [r3 + r4 - r2 - r1, r1 + r4 - r2 - r3, r1 + r3 - r2 - r4]
        else:
            slack = [r3 + r4 - r1 - r2, r2 + r4 - r1 - r3, r2 + r3 - r1 - r4]
        given = self.asked.margin
        margin = TURNS if given is None else given / self.size
        nlp.constrain("full turn", ca.vertcat(*slack) / self.size, margin, np.inf, self.size, "m")
        angles = [a for a in self.held_over_turn if self.of_loop(self.dyad(a.between))]
        least = max((float(angle.min) for angle in angles), default=0.0)
        if least:
            nlp.constrain("transmission", self.cosines(d), -np.cos(least), np.cos(least))

    def cosines(self, d: Sym) -> Sym:
        """Return cos of the angle between coupler and rocker at both of its extremes, (2,)."""
        assert self.loop is not None
        r1, r2, r3, r4 = ca.vertsplit(self.over_free(self.loop.lengths, d))
        return ca.vertcat(
            *[(r3 * r3 + r4 * r4 - r * r) / (2 * r3 * r4) for r in (r1 - r2, r1 + r2)]
        )

    NODES = 48
    """Poses of a turn at which determinants and boxes are watched."""

    @cached_property
    def circle(self) -> Floats:
        """Driver values of those poses."""
        return TURN * np.arange(self.NODES) / self.NODES

    def _turned(self, nlp: Nlp, d: Sym, sigma: Sym) -> None:
        """Add a whole turn of the driver, and poses where transmission angles are least."""
        count = len(self.watched_limits) * WATCHED
        x = self.pose_variables(nlp, "turn", self.NODES + count)
        watched = nlp.parameter("watched", np.zeros(count))
        every = []
        for k in range(self.NODES + count):
            u = self.circle[k] if k < self.NODES else watched[k - self.NODES]
            F, branch, values = self.poses.function(x[:, k], u, d)
            nlp.constrain("closure", F / self.units)
            if k < self.NODES:
                every.append(values)
            if not self.single_loop:
                low = WELL * self.poses.margins
                nlp.constrain("determinants over the turn", sigma * branch, low, np.inf)
            for limit in self.watched_limits:
                sine = self.poses.sine(self.dyad(limit.between), branch, values, sigma)
                nlp.constrain("transmission", sine, np.sin(limit.min), np.inf)
        for k, values in enumerate(every):
            self._boxes(nlp, values, (every[k - 1], every[(k + 1) % self.NODES]))
