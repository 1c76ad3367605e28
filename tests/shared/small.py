"""Small mechanisms, without loops or with one unknown, and where their point is in closed form."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mechdae.describe.file.load import from_dict
from mechdae.describe.file.problem import Problem

WEIGHT = 2 * 9.81
TILT = np.pi / 6
PLANE = 'schema = 1\ntitle = "small"\ngravity = [0, -9.81]\n[parameters]\na = 0.04\n'
SPACE = (
    'schema = 1\ntitle = "small"\ndimension = 3\ngravity = [0, 0, -9.81]\n[parameters]\na = 0.04\n'
)
CRANK = '[bodies.crank]\npoints = { A = [0, 0], B = ["a", 0] }\nmass = 2\ncenter = ["a", 0]\n'
PIN = '[joints]\nA = { kind = "revolute", between = ["ground.A", "crank.A"] }\n'
CRANK_3 = (
    '[bodies.crank]\npoints = { A = [0, 0, 0], B = ["a", 0, 0.01] }\nmass = 2\n'
    'center = ["a", 0, 0]\n'
)
PIN_3 = '[joints]\nA = { kind = "revolute", between = ["ground.A", "crank.A"], axis = [0, 1, 0] }\n'


@dataclass(frozen=True)
class Small:
    """A mechanism and the truth about it.

    Attributes
    ----------
    text
        Of its file, without tasks.
    drivers
        Coordinates that drive it.
    point
        ``body.point`` that is looked at.
    place
        (driver value, a) -> where it is; several drivers have the same value.
    slope
        (driver value, a) -> effort of each driver that holds its weight [N m or N].
    unknowns
        Of a pose.
    """

    text: str
    drivers: tuple[str, ...]
    point: str
    place: Callable[[float, float], tuple[float, ...]]
    slope: Callable[[float, float], tuple[float, ...]]
    unknowns: int = 0

    @property
    def path(self) -> str:
        return f"points/{self.point}/position"

    def driven(self, how: str) -> str:
        """Return the line of a task with its drivers."""
        each = ", ".join(f'{{ coordinate = "{name}", {how} }}' for name in self.drivers)
        return f"drivers = [{each}]\n" if len(self.drivers) > 1 else f"driver = {each}\n"

    def held(self, how: str) -> str:
        """Return the line of a motion or an equilibrium with its drivers."""
        each = ", ".join(f'{{ coordinate = "{name}", {how} }}' for name in self.drivers)
        return f"drivers = [{each}]\n"

    def problem(self, tasks: str) -> Problem:
        """Return the problem with tasks."""
        return from_dict(tomllib.loads(self.text + tasks))


def turned(u: float, x: float, y: float) -> tuple[float, float]:
    """Return a place turned in the plane."""
    return x * np.cos(u) - y * np.sin(u), x * np.sin(u) + y * np.cos(u)


def about_y(u: float, x: float, z: float) -> tuple[float, float, float]:
    """Return a place in the x-z plane turned about y."""
    return x * np.cos(u) + z * np.sin(u), 0.0, -x * np.sin(u) + z * np.cos(u)


SMALL = {
    "crank": Small(
        f"{PLANE}[ground]\npoints = {{ A = [0, 0] }}\n{CRANK}{PIN}[sketch]\ncrank = 0\n",
        ("crank.angle",), "crank.B",
        lambda u, a: turned(u, a, 0), lambda u, a: (WEIGHT * a * np.cos(u),),
    ),
    "slide": Small(
        f'{PLANE}[ground]\npoints = {{ A = [0, 0] }}\n'
        '[bodies.block]\npoints = { A = [0, 0], B = ["a", 0] }\nmass = 2\ncenter = [0, 0]\n'
        '[joints]\n'
        'g = { kind = "prismatic", between = ["ground.A", "block.A"], axis_deg = 30 }\n'
        '[sketch]\ng = 0\n',
        ("g.slide",), "block.B",
        lambda u, a: (a + u * np.cos(TILT), u * np.sin(TILT)),
        lambda u, a: (WEIGHT * np.sin(TILT),), unknowns=2,
    ),
    "belt": Small(
        f'{PLANE}[ground]\npoints = {{ A = [0, 0], D = [0.2, 0] }}\n{CRANK}'
        '[bodies.pulley]\npoints = { D = [0, 0], E = ["a", 0.01] }\n'
        f'{PIN}D = {{ kind = "revolute", between = ["ground.D", "pulley.D"] }}\n'
        'belt = { kind = "belt", between = ["crank.A", "pulley.D"], ratio = 2 }\n'
        '[sketch]\ncrank = 0\npulley = 0\n',
        ("crank.angle",), "pulley.E",
        lambda u, a: tuple(np.add((0.2, 0), turned(u / 2, a, 0.01))),
        lambda u, a: (WEIGHT * a * np.cos(u),),
    ),
    "weld": Small(
        f'{PLANE}[ground]\npoints = {{ A = [0, 0] }}\n{CRANK}'
        '[bodies.arm]\npoints = { B = [0, 0], E = ["a", 0.01] }\n'
        f'{PIN}B = {{ kind = "weld", between = ["crank.B", "arm.B"], turn_deg = 90 }}\n'
        '[sketch]\ncrank = 0\n',
        ("crank.angle",), "arm.E",
        lambda u, a: turned(u, a - 0.01, a), lambda u, a: (WEIGHT * a * np.cos(u),),
    ),
    "rack": Small(
        f'{PLANE}[ground]\npoints = {{ A = [0, 0], G = [0, "-a"] }}\n{CRANK}'
        '[bodies.bar]\npoints = { G = [0, 0], E = ["a", 0.01] }\n'
        f'{PIN}G = {{ kind = "prismatic", between = ["ground.G", "bar.G"], axis_deg = 0 }}\n'
        'mesh = { kind = "rack", between = ["crank.A", "bar.G"], radius = "a" }\n'
        '[sketch]\ncrank = 0\nG = 0\n',
        ("crank.angle",), "bar.E",
        lambda u, a: (a * u + a, 0.01 - a), lambda u, a: (WEIGHT * a * np.cos(u),),
    ),
    "scotch yoke": Small(
        f'{PLANE}[ground]\npoints = {{ A = [0, 0] }}\n{CRANK}'
        '[bodies.yoke]\npoints = { G = [0, 0], E = ["a", 0.01] }\n'
        f'{PIN}G = {{ kind = "prismatic", between = ["ground.A", "yoke.G"], axis_deg = 0 }}\n'
        'S = { kind = "pin-in-slot", between = ["yoke.G", "crank.B"], axis_deg = 90 }\n'
        '[sketch]\ncrank_deg = 30\nG = 0.03\n',
        ("crank.angle",), "yoke.E",
        lambda u, a: (a * np.cos(u) + a, 0.01), lambda u, a: (WEIGHT * a * np.cos(u),),
        unknowns=1,
    ),
    "two cranks": Small(
        f'{PLANE}[ground]\npoints = {{ A = [0, 0] }}\n{CRANK}'
        '[bodies.second]\npoints = { B = [0, 0], E = ["a", 0] }\n'
        f'{PIN}B = {{ kind = "revolute", between = ["crank.B", "second.B"] }}\n'
        '[sketch]\ncrank = 0\nsecond = 0\n',
        ("A.angle", "B.angle"), "second.E",
        lambda u, a: tuple(np.add(turned(u, a, 0), turned(2 * u, a, 0))),
        lambda u, a: (WEIGHT * a * np.cos(u), 0.0),
    ),
    "crank in space": Small(
        f"{SPACE}[ground]\npoints = {{ A = [0, 0, 0] }}\n{CRANK_3}{PIN_3}[sketch]\nA = 0\n",
        ("A.angle",), "crank.B",
        lambda u, a: about_y(u, a, 0.01), lambda u, a: (-WEIGHT * a * np.cos(u),),
    ),
    "slide in space": Small(
        f'{SPACE}[ground]\npoints = {{ A = [0, 0, 0] }}\n'
        '[bodies.block]\npoints = { A = [0, 0, 0], B = ["a", 0, 0.01] }\nmass = 2\n'
        'center = [0, 0, 0]\n'
        '[joints]\n'
        'g = { kind = "prismatic", between = ["ground.A", "block.A"], axis = [0, 0, 1] }\n'
        '[sketch]\ng = 0\n',
        ("g.slide",), "block.B",
        lambda u, a: (a, 0.0, u + 0.01), lambda u, a: (WEIGHT,),
    ),
    "screw": Small(
        f'{SPACE}[ground]\npoints = {{ A = [0, 0, 0] }}\n'
        '[bodies.nut]\npoints = { A = [0, 0, 0], B = ["a", 0, 0.01] }\nmass = 2\n'
        'center = ["a", 0, 0]\n'
        '[joints]\n'
        's = { kind = "screw", between = ["ground.A", "nut.A"], axis = [0, 0, 1], pitch = "a" }\n'
        '[sketch]\ns = 0\n',
        ("s.angle",), "nut.B",
        lambda u, a: (a * np.cos(u), a * np.sin(u), 0.01 + a * u / (2 * np.pi)),
        lambda u, a: (WEIGHT * a / (2 * np.pi),),
    ),
    "gears in space": Small(
        f'{SPACE}[ground]\npoints = {{ A = [0, 0, 0], D = [0, 0, 0.1] }}\n{CRANK_3}'
        '[bodies.wheel]\npoints = { D = [0, 0, 0], E = ["a", 0, 0.01] }\n'
        f'{PIN_3}D = {{ kind = "revolute", between = ["ground.D", "wheel.D"], axis = [0, 1, 0] }}\n'
        'mesh = { kind = "gear", between = ["crank.A", "wheel.D"], ratio = -2 }\n'
        '[sketch]\nA = 0\nD = 0\n',
        ("A.angle",), "wheel.E",
        lambda u, a: tuple(np.add((0, 0, 0.1), about_y(-u / 2, a, 0.01))),
        lambda u, a: (-WEIGHT * a * np.cos(u),),
    ),
}  # fmt: skip
