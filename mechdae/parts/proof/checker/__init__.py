"""Checks certificates in ball arithmetic, knowing nothing of the package that wrote them.

It imports the standard library and python-flint alone: this folder, or the text that its modules
are joined to, can be copied and run by itself. Equations of joints, derivatives and theorems are
written here once more. Nothing in a file is trusted: its numbers are claims, or places to look at.
"""

from __future__ import annotations

from flint import ctx

from .arithmetic import PRECISION, VERSION, FalseClaim, Json, field, need, read
from .counts import PROOFS, check_modes, check_modes_by_boxes
from .counts_on_curves import check_modes_on_curves
from .paths import check_sweep
from .plane import PlanarMechanism
from .space import SpatialMechanism
from .superfluous import ClosedMotion, check_closed_modes, check_closed_sweep
from .theorems_in_plane import IN_PLANE
from .theorems_in_space import IN_SPACE

UNREADABLE = (TypeError, AttributeError, LookupError, ValueError, ArithmeticError, RuntimeError)
"""What a file can lead to that is none."""


def mechanism_of(data: Json, square: bool = True) -> PlanarMechanism | SpatialMechanism:
    """Return the mechanism of a certificate with its equations."""
    ctx.prec = PRECISION
    if field(data, "bodies", dict, "mechanism") and data.get("dimension") == 3:
        return SpatialMechanism(data, square=square)
    if "superfluous" in data and not has_curves(data) and square:
        return ClosedMotion(data)
    return PlanarMechanism(data, square=square)


def has_curves(data: Json) -> bool:
    """Whether the mechanism of a certificate has joints on curves."""
    joints = field(data, "joints", dict, "mechanism").values()
    return any(isinstance(joint, dict) and joint.get("kind") == "curve" for joint in joints)


def verdict(data: Json) -> str:
    """Return what a certificate proves."""
    kind = field(data, "kind", str, "certificate")
    known = kind in ("sweep", "modes") and data.get("certificate") == VERSION
    need(known, "certificate", f"not of version {VERSION}, or not a kind that is checked")
    m = mechanism_of(field(data, "mechanism", dict, "certificate"))
    if isinstance(m, ClosedMotion):
        return check_closed_sweep(m, data) if kind == "sweep" else check_closed_modes(m, data)
    if kind == "sweep":
        return check_sweep(m, data)
    if isinstance(m, SpatialMechanism):
        if data.get("proof") in PROOFS:
            return check_modes_by_boxes(m, data)
        return check_modes(m, data, IN_SPACE)
    if has_curves(data["mechanism"]):
        return check_modes_on_curves(m, data)
    return check_modes(m, data, IN_PLANE)


def check(path: str) -> str:
    """Check a certificate and return what was proved; the first false claim raises `FalseClaim`."""
    ctx.prec = PRECISION
    data = read(path)
    try:
        return verdict(data)
    except UNREADABLE as why:
        message = f"cannot be read or proved: {str(why)[:200]}"
        raise FalseClaim("certificate", message) from None
