"""From where a spatial mechanism is looked at: parallel projection along one direction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechdae.describe.mechanism import Mechanism
from mechdae.errors import InputError
from mechdae.records import dataclass

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Viewpoint:
    """A direction to look from.

    Parameters
    ----------
    azimuth, elevation
        Of the eye [deg]: the turn about the upward direction, from the axis that follows it, and
        the height above the horizon.
    upward
        (3,) unit vector that is upright in the picture.
    name
        What the view is called, "" without a name.
    """

    azimuth: float
    elevation: float
    upward: tuple[float, float, float] = (0.0, 0.0, 1.0)
    name: str = ""

    @cached_property
    def basis(self) -> Array:
        """Rows: to the right, upwards in the picture, towards the eye; (3, 3)."""
        up = np.array(self.upward)
        k = int(np.argmax(np.abs(up)))
        first = np.eye(3)[(k + 1) % 3]
        first = first - up * (first @ up)
        first = first / np.linalg.norm(first)
        second = np.cross(up, first)
        a, e = np.deg2rad(self.azimuth), np.deg2rad(self.elevation)
        ahead = np.cos(a) * first + np.sin(a) * second
        eye = np.cos(e) * ahead + np.sin(e) * up
        right = -np.sin(a) * first + np.cos(a) * second
        return np.array([right, np.cross(eye, right), eye])

    def seen(self, vectors: ArrayLike) -> Array:
        """Return vectors or places (..., 3) as right, up, towards the eye."""
        return np.asarray(vectors, dtype=float) @ self.basis.T

    def flat(self, places: ArrayLike) -> Array:
        """Return places (..., 3) in the picture, (..., 2), in the same unit."""
        return self.seen(places)[..., :2]


def upward_of(mechanism: Mechanism) -> tuple[float, float, float]:
    """Return what is up: against gravity; without it z, of vector loops y, where azimuths turn."""
    values = mechanism.values()
    pull = [values.get(f"gravity.{axis}", 0.0) for axis in mechanism.axes]
    size = float(np.linalg.norm(pull))
    if size > 0:
        x, y, z = (float(-part / size) + 0.0 for part in pull)
        return x, y, z
    pointing = any(joint.pointer for joint in mechanism.joints.values())
    return (0.0, 1.0, 0.0) if pointing else (0.0, 0.0, 1.0)


def viewpoint(mechanism: Mechanism, view: str | Sequence[float] | Viewpoint) -> Viewpoint:
    """Return the viewpoint that is asked for: ``"azimuth,elevation"`` or two numbers [deg].

    Raises
    ------
    InputError
        Not two numbers, or an elevation beyond the vertical.
    """
    if isinstance(view, Viewpoint):
        return view
    hint = "azimuth and elevation in degrees, like 30,20"
    parts = view.split(",") if isinstance(view, str) else view
    try:
        azimuth, elevation = (float(part) for part in parts)
    except (TypeError, ValueError):
        raise InputError(
            f"'{view}' is no direction to look from", where="view", hint=hint
        ) from None
    if not np.isfinite([azimuth, elevation]).all() or abs(elevation) > 90.0:
        raise InputError("an elevation is from -90 to 90 degrees", where="view", hint=hint)
    return Viewpoint(azimuth, elevation, upward_of(mechanism))


def orthographic(mechanism: Mechanism) -> dict[str, Viewpoint]:
    """Return the three views of a technical drawing: front, top and left side."""
    up = upward_of(mechanism)
    front = 0.0 if abs(up[1]) > 0.9 else -90.0
    named: Mapping[str, tuple[float, float]] = {
        "front view": (front, 0.0),
        "top view": (front, 90.0),
        "left view": (front - 90.0, 0.0),
    }
    return {name: Viewpoint(a, e, up, name) for name, (a, e) in named.items()}
