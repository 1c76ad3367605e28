"""The kind of task that asks how far outputs wander because joints have clearance."""

from __future__ import annotations

from dataclasses import fields
from typing import ClassVar

from mechdae.describe.joints.joint import GAPS
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.tasks.kinds import Sweep
from mechdae.describe.tasks.motion import Reactions
from mechdae.errors import MechanismError, UnavailableError
from mechdae.records import dataclass, optional


@dataclass(frozen=True)
class Play(Sweep):
    """Bands of points, angles and slides along a sweep, from the clearance of the joints.

    Under load it also says on which side of its gap each joint lies.

    Examples
    --------
    >>> task = md.Play(md.Driver("crank.angle", range="assembled"), poses=37, under_load=True)
    >>> task.poses
    37
    """

    under_load: bool = optional("flag", False, doc="also where the loads press each joint")

    kind: ClassVar[str] = "play"
    in_space: ClassVar[bool] = False
    holds: ClassVar[tuple[str, ...]] = ("poses", "path", "rates", "bands")

    def check(self, mechanism: Mechanism) -> None:
        super().check(mechanism)
        if mechanism.dimension == 3:
            raise UnavailableError(
                "bands are not computed in space: joints place bodies there, without equations "
                "that a clearance opens", where="kind",
                hint="tolerances of a task of kind sensitivity: what lengths that are off move",
            )  # fmt: skip
        given = [name for name, _ in mechanism.numbers() if name.rpartition(".")[2] in GAPS]
        if not given:
            raise MechanismError(
                "no joint has a clearance", where="joints", hint="clearance_mm = 0.02 of a pin"
            )

    def with_forces(self) -> Reactions:
        """Return the task of reactions along the same way."""
        return Reactions(**{entry.name: getattr(self, entry.name) for entry in fields(Sweep)})
