"""The kind of task that looks for a type and its dimensions together."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from mechdae.describe import Mechanism, Task
from mechdae.describe.values import Number
from mechdae.parts.types.described.composition import (
    CurveGoal,
    SchemeFunction,
    SchemePath,
    bare_crank,
)
from mechdae.records import dataclass, optional

if TYPE_CHECKING:
    from mechdae.describe.values import NamesOrNone, NumbersOrNone

__all__ = ["Composition", "CurveGoal"]


@dataclass(frozen=True)
class Composition(Task):
    """Type and dimensions together: schemes of dyads with a crank that trace a closed curve.

    Or their point visits targets (``path``), or an angle or a slide is a function of that of the
    crank (``function``).

    Examples
    --------
    >>> goal = md.CurveGoal(x="0.1*cos(s)", y="0.05*sin(s)")
    >>> md.Composition(goal=goal, links=[4, 6], seed=1).links
    (4.0, 6.0)
    """

    goal: CurveGoal | SchemePath | SchemeFunction | None = optional("scheme_goal")
    objectives: NamesOrNone = optional(
        "names",
        doc="of the front: error, material, joints, points, transmission_angle, loss",
    )
    reference: NumbersOrNone = optional(
        "numbers", doc="worst value of each objective that a front is measured from"
    )
    links: NumbersOrNone = optional("numbers", doc="of the chains; absent: [4, 6]", unit="1")
    chains: NamesOrNone = optional(
        "names", doc="in place of links: four-bar, watt, stephenson, 8-1, 8-2, ..."
    )
    pairs: NamesOrNone = optional("names", doc='kinds of joints: ["R"], ["R", "P"]')
    within: Mapping[str, Number] | None = optional(
        "coordinates", doc="limits on objectives: name -> most, of transmission_angle least"
    )
    friction: Number | None = optional("number", doc="of all joints, for the loss", unit="1")
    pin_radius: Number | None = optional("number", doc="of all pins, for the loss", unit="m")
    load: NumbersOrNone = optional(
        "numbers",
        doc="for the loss: [x, y] of the force on the tracing point, or [what resists the output]",
    )
    points: int | None = optional("whole", doc="most pins, with the tracing point; 12")
    samples: int | None = optional("whole", doc="sets of dimensions drawn of each scheme")
    starts: int | None = optional("whole", doc="sets of each scheme that are refined")
    grow: int | None = optional("natural", doc="rounds of growth by points and dyads, 2")
    seed: int | None = optional("natural")
    keep: int | None = optional("whole", doc="designs that are reported, 20")

    kind: ClassVar[str] = "composition"
    in_space: ClassVar[bool] = False
    holds: ClassVar[tuple[str, ...]] = ("schemes",)

    @classmethod
    def bare_mechanism(cls) -> Mechanism:
        """Return what all schemes begin with."""
        return bare_crank()
