"""What a scheme is to do, in numbers without units: a closed curve, places to visit, a function."""

from __future__ import annotations

import numpy as np

from mechdae.parts.types.described.composition import CompositionDemand
from mechdae.parts.types.schemes.shape import Wanted
from mechdae.records import dataclass
from mechdae.types import Floats

CURVE, PATH, ANGLE, SLIDE = "curve", "path", "angle", "slide"
TURN = 2 * np.pi
WHOLE = (0.0, TURN)


@dataclass(frozen=True)
class Aim:
    """What pieces of work need to know of a goal; errors and lengths are in its own units.

    Attributes
    ----------
    what
        `CURVE`, `PATH`, or the output of a function: `ANGLE`, `SLIDE`.
    corners
        Of a curve (k,), complex [m].
    targets
        Places (k,), complex, with their middle at zero and radius 1; or values of the output.
    angles
        Of the crank at each target, from the first one [rad]; none: they are free.
    ordered
        Targets without angles are visited in their order, in either sense of the crank.
    weights
        (k,) of the targets, 1 together.
    span
        Angles of the crank, from the first target, over which all has to assemble.
    radius
        Unit of lengths [m].
    unit
        Of the error: what it is multiplied with for the one that is reported.
    center
        Middle of the targets [m].
    """

    what: str
    corners: tuple[complex, ...] = ()
    targets: tuple[complex, ...] = ()
    angles: tuple[float, ...] = ()
    ordered: bool = True
    weights: tuple[float, ...] = ()
    span: tuple[float, float] = WHOLE
    minimax: bool = False
    radius: float = 1.0
    unit: float = 1.0
    center: complex = 0j

    @property
    def turns(self) -> bool:
        """Whether the crank turns fully."""
        return self.span[1] - self.span[0] >= TURN * (1 - 1e-12)

    def nodes(self, count: int) -> Floats:
        """Return angles (k + count,): those of the targets, then some over the whole span."""
        low, high = self.span
        if self.turns:
            grid = low + (high - low) * np.arange(count) / count
        else:
            grid = np.linspace(low, high, count)
        return np.concatenate([np.asarray(self.angles, float), grid])


def aim_of(demand: CompositionDemand) -> Aim:
    if demand.function is not None:
        return _function(demand)
    if demand.visits is not None:
        return _visits(demand)
    corners = np.array([complex(x, y) for x, y in demand.corners])
    return Aim(CURVE, tuple(corners.tolist()), radius=Wanted(corners).radius)


def _visits(demand: CompositionDemand) -> Aim:
    visits = demand.visits
    assert visits is not None
    spots = np.array([complex(x, y) for x, y in visits.targets])
    weights = np.array(visits.weights, float)
    weights = weights / weights.sum()
    center = complex((weights * spots).sum())
    radius = float(np.sqrt((weights * np.abs(spots - center) ** 2).sum()))
    angles, span = (), WHOLE
    if visits.programme:
        steps = np.array(visits.programme, float) - visits.programme[0]
        angles = tuple(steps.tolist())
        if not visits.closed:
            span = (float(steps.min()), float(steps.max()))
    return Aim(
        PATH, targets=tuple(((spots - center) / radius).tolist()), angles=angles,
        ordered=visits.timing != "any", weights=tuple(weights.tolist()), span=span,
        minimax=visits.measure == "minimax",
        radius=radius, unit=radius, center=center,
    )  # fmt: skip


def _function(demand: CompositionDemand) -> Aim:
    wanted = demand.function
    assert wanted is not None
    outputs = np.array(wanted.outputs, float)
    size = float(outputs.std()) if wanted.slides else 1.0
    steps = np.array(wanted.inputs, float)
    count = len(outputs)
    return Aim(
        SLIDE if wanted.slides else ANGLE, targets=tuple((outputs / size).tolist()),
        angles=tuple(steps.tolist()), weights=(1 / count,) * count,
        span=(float(steps.min()), float(steps.max())),
        minimax=wanted.minimax,
        radius=size, unit=size,
    )  # fmt: skip
