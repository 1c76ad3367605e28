"""Change points as a certificate has them: exact places, angles and driver in right angles."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from mechdae.errors import UnavailableError
from mechdae.parts.proof.checker import mechanism_of
from mechdae.parts.proof.checker.arithmetic import FalseClaim, exact, exacts
from mechdae.parts.proof.checker.crossings import ExactChangePoint
from mechdae.parts.proof.superfluous import origins

if TYPE_CHECKING:
    from mechdae.types import Json


NEAR = 1e-6
"""How far an angle may be off right angles to be taken for them, as near as rounding lets it be."""


def meeting(mechanism: dict[str, Json], bodies: dict[str, list[str]], s: float) -> Json:
    """Return the exact pose near `bodies` at a change point, with the driver at `s`."""
    angles = {body: float(Fraction(place[2])) for body, place in bodies.items()} | {"": s}
    counts = {body: round(angle / (math.pi / 2)) for body, angle in angles.items()}
    if any(abs(angles[body] - count * math.pi / 2) > NEAR for body, count in counts.items()):
        raise _refused("where angles are no right angles", s)
    turns = {body: (0, count) for body, count in counts.items()} | {"ground": (0, 0)}
    found = origins(mechanism, turns)
    if not found.keys() >= bodies.keys():
        raise _refused("where not all bodies are linked by pins", s)
    place = {
        body: [*(str(waves.get((0, "c"), Fraction(0))) for waves in found[body]), str(counts[body])]
        for body in bodies
    }
    m: Any = mechanism_of(mechanism)
    numbers = [v for body in m.bodies for v in exacts(place[body], 3, body)]
    try:
        ExactChangePoint(m, [*numbers, exact(str(counts[""]), "at")], "at")
    except (FalseClaim, ArithmeticError, ValueError) as why:
        raise _refused(f"that is not exact ({why})", s) from None
    return {"at": str(counts[""]), "bodies": place}


def _refused(why: str, s: float) -> UnavailableError:
    return UnavailableError(
        f"no certificate is written of a motion across a change point {why}: near {s:.6g}"
    )
