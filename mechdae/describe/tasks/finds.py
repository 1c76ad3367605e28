"""Where an output crosses a value, or is largest or smallest, along a sweep."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from mechdae.describe.expression import unknown_name
from mechdae.describe.mechanism import Mechanism
from mechdae.describe.named import check_expression
from mechdae.describe.values import Number, Value
from mechdae.errors import InputError, MechdaeError
from mechdae.records import dataclass, key, optional

if TYPE_CHECKING:
    from mechdae.describe.values import UnitOf


@dataclass(frozen=True)
class Find(Value):
    """The places at which an output crosses a value, or the one at which it is extreme.

    ``output`` is a named output or an expression of coordinates, their rates and, in a task of
    forces, of these.
    """

    output: str = key("text", doc="a named output, or an expression")
    crosses: Number | None = optional("number", doc="the value that it crosses")
    extreme: str | None = optional("text", choices=("max", "min"))
    direction: str = optional("text", "both", choices=("both", "up", "down"))
    name: str | None = optional("text", doc="how the event is called")

    def units_by_key(self, unit_of: UnitOf) -> dict[str, str | None]:
        return {"crosses": unit_of(self.output)}

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.crosses is None) == (self.extreme is None):
            raise InputError(
                "one of 'crosses' and 'extreme' is needed", hint='crosses = 10, or extreme = "max"'
            )
        if self.extreme is not None and self.direction != "both":
            raise InputError("an extreme has no direction", where="direction")


def check_finds(mechanism: Mechanism, finds: Sequence[Find], way: int) -> None:
    """Raise for outputs that do not exist, and for a task whose `way` is no interval."""
    for i, find in enumerate(finds):
        try:
            check_expression(mechanism, find.output, "output", forces=True)
            unknown_name([find.crosses], mechanism.parameter_values, place="crosses")
        except MechdaeError as problem:
            raise problem.inside(f"find[{i}]") from None
    if finds and way < 3:
        raise InputError(
            "the driver does not move over an interval",
            where="find",
            hint="driver = { from = ..., to = ... }",
        )
