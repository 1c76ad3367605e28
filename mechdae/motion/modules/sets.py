"""Geometric sets that the head of a vector runs over, as arrays: one row a datum."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mechdae.records import dataclass
from mechdae.types import Floats, Integers, Matrices

Y = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True)
class Vector3:
    """A vector of many data: its unknown letters, and arrays (n,) of what is known of it."""

    unknown: str
    known: Mapping[str, Floats]

    @property
    def u(self) -> Floats:
        """Direction (n, 3)."""
        e, a = self.known["elevation"], self.known["azimuth"]
        return np.stack([np.cos(e) * np.cos(a), np.sin(e), np.cos(e) * np.sin(a)], axis=-1)

    @property
    def h(self) -> Floats:
        """Normal of the vertical plane of an azimuth: direction in which it turns."""
        a = self.known["azimuth"]
        return np.stack([-np.sin(a), np.zeros_like(a), np.cos(a)], axis=-1)

    @property
    def across(self) -> Floats:
        """Direction of an azimuth in the x-z plane."""
        a = self.known["azimuth"]
        return np.stack([np.cos(a), np.zeros_like(a), np.sin(a)], axis=-1)

    def value(self, found: Mapping[str, Floats]) -> Floats:
        """Return the vector (..., 3) with its unknowns found, arrays (n, k)."""
        length, e, a = (
            found[word] if word in found else self.known[word][:, None]
            for word in ("length", "elevation", "azimuth")
        )
        level = length * np.cos(e)
        return np.stack(
            np.broadcast_arrays(level * np.cos(a), length * np.sin(e), level * np.sin(a)), axis=-1
        )

    def unknowns_of(self, w: Matrices) -> dict[str, Floats]:
        """Return the unknowns (n, k) of the vector that is w (n, k, 3)."""
        x, y, z = np.moveaxis(w, -1, 0)
        if self.unknown == "l":
            return {"length": np.einsum("nkc,nc->nk", w, self.u)}
        if self.unknown in ("a", "la"):
            along = np.einsum("nkc,nc->nk", w, self.across)
            sign = np.sign(self.known["length"])[:, None] if self.unknown == "a" else 1.0
            found = {"elevation": np.arctan2(sign * y, sign * along)}
            return found if self.unknown == "a" else {"length": np.hypot(y, along), **found}
        if self.unknown == "lab":
            level = np.hypot(x, z)
            return {
                "length": np.hypot(level, y),
                "elevation": np.arctan2(y, level),
                "azimuth": np.arctan2(z, x),
            }
        if self.unknown == "ab":
            length = self.known["length"][:, None]
            sign = np.sign(length)
            level = np.sqrt(np.maximum(length**2 - y**2, 0.0))
            return {
                "elevation": np.arctan2(sign * y, level),
                "azimuth": np.arctan2(sign * z, sign * x),
            }
        e = self.known["elevation"][:, None]
        if self.unknown == "lb":
            steep = np.abs(np.sin(e)) >= np.abs(np.cos(e))
            level = np.hypot(x, z) * np.sign(y * np.sin(e) * np.cos(e) + (y == 0))
            with np.errstate(all="ignore"):
                length = np.where(steep, y / np.sin(e), level / np.cos(e))
        else:
            length = self.known["length"][:, None]
        sign = np.sign(length * np.cos(e))
        azimuth = np.arctan2(sign * z, sign * x)
        found = {"azimuth": azimuth}
        return found if self.unknown == "b" else {"length": length, **found}

    def columns(self, found: Mapping[str, Floats]) -> list[Floats]:
        """Return the derivatives (n, k, 3) of the vector by its unknowns."""
        length, e, a = np.broadcast_arrays(
            *(
                found[word] if word in found else self.known[word][:, None]
                for word in ("length", "elevation", "azimuth")
            )
        )
        ce, se, ca, sa = np.cos(e), np.sin(e), np.cos(a), np.sin(a)
        each = {
            "l": (ce * ca, se, ce * sa),
            "a": (-length * se * ca, length * ce, -length * se * sa),
            "b": (-length * ce * sa, np.zeros_like(e), length * ce * ca),
        }
        return [np.stack(each[letter], axis=-1) for letter in self.unknown]


@dataclass(frozen=True)
class Circle:
    """Places centre + first cos t + second sin t, each (n, 3); first and second are normal."""

    centre: Floats
    first: Any
    second: Floats

    def at(self, t: Floats) -> Any:
        """Return the places (n, m, 3) at angles (n, m)."""
        return (
            self.centre[:, None, :]
            + self.first[:, None, :] * np.cos(t)[..., None]
            + self.second[:, None, :] * np.sin(t)[..., None]
        )

    @property
    def radius(self) -> Any:
        return np.sqrt((self.first**2).sum(axis=-1))

    @property
    def normal(self) -> Any:
        """Unit normal (n, 3)."""
        across = np.cross(self.first, self.second)
        with np.errstate(all="ignore"):
            return across / np.linalg.norm(across, axis=-1, keepdims=True)

    def taken(self, others: list[Circle], which: Integers) -> Circle:
        """Return for each datum this circle (0) or one of the others (1, 2, ...)."""
        every = [self, *others]
        rows = np.arange(len(which))
        return Circle(
            *(
                np.stack([getattr(circle, word) for circle in every])[which, rows]
                for word in ("centre", "first", "second")
            )
        )


def circle(vector: Vector3) -> Circle:
    """Return the circle of a vector whose elevation or azimuth is unknown."""
    length = vector.known["length"][:, None]
    if vector.unknown == "a":
        return Circle(np.zeros((len(length), 3)), length * vector.across, length * Y)
    e = vector.known["elevation"][:, None]
    level = length * np.cos(e)
    return Circle(
        length * np.sin(e) * Y, level * np.array([1.0, 0, 0]), level * np.array([0, 0, 1.0])
    )
