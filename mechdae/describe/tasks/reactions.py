"""Forces along a sweep, as they are asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from mechdae.describe.tasks.kinds import Sweep
from mechdae.errors import InputError
from mechdae.records import dataclass, optional

if TYPE_CHECKING:
    from mechdae.describe.values import NamesOrNone


@dataclass(frozen=True)
class Reactions(Sweep):
    """Joint reactions, friction losses and efforts along a sweep.

    Examples
    --------
    >>> result = md.solve("slider-crank-friction", "cycle", poses=5)
    >>> result.efforts["crank.angle"].round(2).tolist()
    [4.32, 108.43, 3.32, 21.66, 0.86]
    """

    friction: str = optional(
        "text", "coupled", choices=("none", "article", "coupled"),
        doc="left out, or on reactions as they are without it, or with it",
    )  # fmt: skip
    friction_radius: str = optional(
        "text",
        "exact",
        choices=("exact", "article"),
        doc="r sin(atan f), or r f",
    )
    cycle: bool = optional("flag", False, doc="mean powers and efficiency over the sweep")
    direction: str = optional(
        "text",
        "driver",
        choices=("driver", "load", "both"),
        doc="load: resistances push",
    )
    parts: NamesOrNone = optional(
        "names", choices=("static", "inertial"), doc="efforts that are given apart too"
    )
    axes: NamesOrNone = optional(
        "names", choices=("body", "radial"), doc="further axes that reactions are given in"
    )

    kind: ClassVar[str] = "reactions"
    holds: ClassVar[tuple[str, ...]] = ("poses", "path", "rates")
    forces: ClassVar[bool] = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.untimed and not self.quasi_static:
            names = ", ".join(driver.coordinate for driver in self.untimed)
            raise InputError(
                f"no speed of {names} is given, and forces depend on it",
                where="driver" if self.drivers is None else "drivers",
                hint="speed = 0 for a driver that rests; without any speed forces are quasi-static",
            )
        if self.quasi_static and "inertial" in (self.parts or ()):
            raise InputError(
                "inertial parts are asked for and no driver has a speed",
                where="parts",
                hint='driver.speed = ..., or parts = ["static"]',
            )

    @property
    def quasi_static(self) -> bool:
        """Whether no driver is told how fast it moves: forces are the limit of slow motion."""
        return bool(self.untimed) and not any(
            driver.timed and not driver.rests for driver in self.all_drivers
        )
