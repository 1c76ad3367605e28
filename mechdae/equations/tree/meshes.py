"""The equation of a mesh in space."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from mechdae.describe.joints.bearings import bearings
from mechdae.describe.joints.joint import Joint
from mechdae.describe.mechanism import Mechanism

if TYPE_CHECKING:
    from mechdae.types import Sym


def meshed(
    mechanism: Mechanism, mesh: Joint, number: Callable[[str], Any], value: Callable[..., Any]
) -> tuple[Sym, str]:
    """Return the equation of a mesh and its unit.

    Parameters
    ----------
    number
        Gives a number of the mesh by its key.
    value
        Gives the coordinate of a joint by the joint and the word.
    """
    first, second = (b.sense * value(b.joint, b.word) for b in bearings(mechanism, mesh))
    if mesh.wheels > 1:
        return number("ratio") * second + number("phase") - first, "rad"
    return number("radius") * first + number("phase") - second, "m"
