"""The 4 planar and 20 spatial modules: unknowns, equations, numbers of solutions, bad poses.

A vector is length times (cos a, sin a) in the plane and length times (cos e cos a, sin e,
cos e sin a) in space: e is the elevation out of the x-z plane towards y, a the azimuth in it from x
towards z. A module is a closed loop with as many unknowns as equations: two, or three.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

from mechdae.records import dataclass

if TYPE_CHECKING:
    from mechdae.types import Json


WORDS = {"l": "length", "a": "elevation", "b": "azimuth"}
PLANE_WORDS = {"l": "length", "a": "angle"}
SETS = {
    "l": "line",
    "a": "circle",
    "b": "circle",
    "la": "plane",
    "lb": "cone",
    "ab": "sphere",
    "lab": "space",
}
"""What the head of a vector runs over, by its unknowns, in space."""


@dataclass(frozen=True)
class Module:
    """One module: its name has the unknown letters of each vector, ``lb-a``.

    ``degree`` is that of the equation in one unknown (in cos and sin of an angle, or in a length),
    ``solutions`` how many vectors may solve it at most, ``determinant`` the Jacobian determinant of
    the closure by the unknowns up to its sign, ``degenerate`` the poses where it vanishes. A
    ``singular`` one has no solution in general.
    """

    name: str
    space: bool
    number: int
    sets: tuple[str, ...]
    equation: str
    degree: int
    solutions: int
    determinant: str
    degenerate: str
    singular: bool = False

    @property
    def unknowns(self) -> tuple[str, ...]:
        """The unknown letters of each vector."""
        return tuple(self.name.split("-"))

    def plain(self) -> Json:
        """Return it as plain data, with the unknowns in words."""
        words = WORDS if self.space else PLANE_WORDS
        return asdict(self) | {
            "unknowns": [[words[u] for u in letters] for letters in self.unknowns]
        }


_Row = tuple[str, tuple[str, ...], str, int, int, str, str]
_PLANAR: list[_Row] = [
    ("la", ("plane",), "v = d", 1, 1, "l", "d = 0: any angle"),
    ("l-l", ("line", "line"), "l1 u1 + l2 u2 = d", 1, 1, "sin(a2 - a1)", "parallel"),
    ("l-a", ("line", "circle"), "u1 x (d - v2) = 0", 1, 2, "l2 cos(a1 - a2)",
     "v2 at right angles to u1"),
    ("a-a", ("circle", "circle"), "|d - v2|^2 = l1^2", 1, 2, "l1 l2 sin(a2 - a1)",
     "stretched or folded; d = 0 with l1 = l2: any angle"),
]  # fmt: skip
PLANAR = tuple(
    Module(row[0], False, number, *row[1:]) for number, row in enumerate(_PLANAR, start=1)
)
"""The planar modules."""

_POLE = "pole: cos e = 0, the azimuth is free"
_SPATIAL: tuple[tuple[str, str, int, int, str, str], ...] = (
    ("lab", "v = d", 1, 1, "l^2 cos e", f"d = 0; {_POLE}"),
    ("la-l", "h1.(d - l2 u2) = 0", 1, 1, "l1 cos e2 sin(a2 - a1)",
     "the second vector in the plane of the first, l1 = 0"),
    ("la-a", "h1.(d - v2) = 0", 1, 2, "l1 l2 sin e2 sin(a2 - a1)",
     "second circle touches the plane, or lies in it"),
    ("la-b", "h1.(d - v2) = 0", 1, 2, "l1 l2 cos e2 cos(a2 - a1)", "circle touches the plane"),
    ("lb-l", "w = d - l2 u2 on the cone", 2, 2, "l1 cos e1 (n1.u2)", "line touches the cone"),
    ("lb-a", "w = d - v2 on the cone", 2, 4, "l1 l2 cos e1 (n1.n2)", "circle touches the cone"),
    ("lb-b", "w = d - v2 on the cone", 1, 2, "l1 l2 cos e1 cos e2 sin e1 sin(a2 - a1)",
     "azimuths alike or opposite; cone flat or pointed"),
    ("ab-l", "|d - l2 u2|^2 = l1^2", 2, 2, "l1^2 cos e1 (u1.u2)", f"line touches; {_POLE}"),
    ("ab-a", "|d - v2|^2 = l1^2", 1, 2, "l1^2 l2 cos e1 (u1.n2)", f"circle touches; {_POLE}"),
    ("ab-b", "|d - v2|^2 = l1^2", 1, 2, "l1^2 l2 cos^2 e1 cos e2 sin(a1 - a2)",
     f"circle touches; {_POLE}"),
    ("l-l-l", "l1 u1 + l2 u2 + l3 u3 = d", 1, 1, "u1.(u2 x u3)", "three directions in a plane"),
    ("l-l-a", "(u1 x u2).(d - v3) = 0", 1, 2, "l3 (u1 x u2).n3", "parallel lines; circle touches"),
    ("l-l-b", "(u1 x u2).(d - v3) = 0", 1, 2, "l3 cos e3 (u1 x u2).h3",
     "parallel lines; circle touches"),
    ("l-a-a", "across u1: |A3^-1 (d' - v2')|^2 = 1", 2, 4, "l2 l3 u1.(n2 x n3)",
     "u1 in the plane of the circle that is inverted; circles touch"),
    ("l-a-b", "across u1: |A3^-1 (d' - v2')|^2 = 1", 2, 4, "l2 l3 cos e3 u1.(n2 x h3)",
     "u1 in the plane of the circle that is inverted; circles touch"),
    ("l-b-b", "across u1: |A3^-1 (d' - v2')|^2 = 1", 1, 2,
     "l2 l3 cos e2 cos e3 sin e1 sin(a3 - a2)", "u1 level (sin e1 = 0); circles touch"),
    ("a-a-a", "(s^2 + A - B)^2 = 4 s^2 A", 4, 8, "l1 l2 l3 n1.(n2 x n3)",
     "tangents in a plane; s = 0: both signs"),
    ("a-a-b", "(s^2 + A - B)^2 = 4 s^2 A", 4, 8, "l1 l2 l3 cos e3 n1.(n2 x h3)",
     "tangents in a plane; s = 0: both signs"),
    ("a-b-b", "(s^2 + A - B)^2 = 4 s^2 A", 4, 4,
     "l1 l2 l3 cos e1 cos e2 cos e3 sin(a3 - a2)", "azimuths of 2 and 3 alike; e1 a right angle"),
    ("b-b-b", "the y row holds no unknown: sum of l sin e = d_y", 0, 0, "0",
     "always: no solution in general, infinitely many where the y row holds by itself"),
)  # fmt: skip
SPATIAL = tuple(
    Module(
        row[0],
        True,
        number,
        tuple(SETS[word] for word in row[0].split("-")),
        *row[1:],
        singular=row[0] == "b-b-b",
    )
    for number, row in enumerate(_SPATIAL, start=1)
)
"""The spatial modules, in the natural order; one of them is none."""
MODULES = {module.name: module for module in SPATIAL}
PLANE = {module.name: module for module in PLANAR}
