"""Forces in mechanisms by free bodies: the reference of the tests of reactions.

NumPy and the closed forms of `closed_forms` only, nothing of the package. Each moving body has
its three equations of balance (moments about the origin of the fixed frame), each joint its
unknown force components, and friction is added to both sides of a joint as the law says. All in
``longdouble``, planar vectors are complex, poses are rows.

At fixed signs of the relative speeds friction is positively homogeneous in the unknowns x, so
that it equals J(x) x with its own derivative J, and Newton's method reads
(A + J(x_k)) x_(k+1) = b. `every_solution` takes the sides of the contacts one after the other
instead and keeps the answers that agree with their own assumption.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise, product
from typing import Any

import numpy as np

from tests.reference.closed_forms import (
    circle_circle,
    circle_line,
    gorshkov_seven_link,
    slotted_link,
)
from tests.reference.jets import Jet, arg, unit

LONG, COMPLEX = np.longdouble, np.clongdouble


def moment(at: Any, force: Any) -> Any:
    """Return the moment of a force at a point about the origin."""
    return np.imag(np.conj(at) * force)


def circle(radius: float, f: float) -> Any:
    """Return the radius of the friction circle, r sin(atan f)."""
    f = LONG(f)
    return LONG(radius) * f / np.sqrt(1 + f * f)


def solve_linear(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solve a stack of equations by elimination with scaled rows and columns, and refine once."""
    across = np.abs(matrix).max(axis=1)
    scaled = matrix / across[:, None, :]
    down = np.abs(scaled).max(axis=2)
    scaled = scaled / down[:, :, None]
    first = _eliminate(scaled, right / down)
    rest = right / down - (scaled * first[:, None, :]).sum(axis=2)
    return (first + _eliminate(scaled, rest)) / across


def _eliminate(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    a = np.concatenate([matrix, right[:, :, None]], axis=2)
    n, k = right.shape
    rows = np.arange(n)
    for j in range(k):
        p = j + np.argmax(np.abs(a[:, j:, j]), axis=1)
        a[rows, p], a[rows, j] = a[rows, j], a[rows, p]
        a[:, j] = a[:, j] / a[:, j, j][:, None]
        for i in range(k):
            if i != j:
                a[:, i] = a[:, i] - a[:, i, j][:, None] * a[:, j]
    return a[:, :, k]


# -- parts of a scene ------------------------------------------------------------------------------


@dataclass
class Mass:
    """Mass and inertia of a body, with the place and acceleration of its centre."""

    mass: float = 0.0
    inertia: float = 0.0
    center: Any = 0.0
    acceleration: Any = 0.0
    turning: Any = 0.0


@dataclass
class Pin:
    """Revolute joint; ``spin`` is second minus first."""

    first: str
    second: str
    at: Any
    spin: Any = 0.0
    rho: Any = 0.0
    size = 2

    def columns(self):
        return [(1.0, 0.0), (1j, 0.0)]

    def friction(self, x):
        """Return force, place and moment on the second body by each unknown."""
        whole = np.hypot(*x)
        safe = np.where(whole == 0, 1, whole)
        turn = -self.rho * np.sign(self.spin)
        return [(0.0, self.at, turn * part / safe) for part in x]

    def loss(self, x):
        return self.rho * np.hypot(*x) * np.abs(self.spin)


@dataclass
class Guide:
    """Prismatic joint; unknown: normal force to the left of the axis, moment about ``at``."""

    first: str
    second: str
    at: Any
    axis: Any
    speed: Any
    f: float = 0.0
    half: float | None = None
    size = 2

    def columns(self):
        return [(1j * self.axis, 0.0), (0.0, 1.0)]

    def grip(self, x):
        """Return the derivative of the sum of the contact forces by normal force and moment."""
        normal, turn = x
        if self.half is None:
            return np.sign(normal), 0 * normal
        tilts = np.abs(turn) > self.half * np.abs(normal)
        return (
            np.where(tilts, 0, np.sign(normal)),
            np.where(tilts, np.sign(turn) / LONG(self.half), 0),
        )

    def friction(self, x):
        return [(-self.f * np.sign(self.speed) * g * self.axis, self.at, 0.0) for g in self.grip(x)]

    def loss(self, x):
        return (
            self.f * sum(g * y for g, y in zip(self.grip(x), x, strict=True)) * np.abs(self.speed)
        )


@dataclass
class Slot:
    """Pin of the second body in a slot of the first: one contact, on the surface of the pin."""

    first: str
    second: str
    at: Any
    axis: Any
    speed: Any
    spin: Any = 0.0
    f: float = 0.0
    radius: float = 0.0
    size = 1

    def columns(self):
        return [(1j * self.axis, 0.0)]

    def rubbing(self, side):
        """Return the speed of the pin's material at the contact, along the axis."""
        return self.speed + side * self.radius * self.spin

    def friction(self, x):
        side = np.sign(x[0])
        force = -self.f * np.sign(self.rubbing(side)) * side * self.axis
        return [(force, self.at - side * self.radius * 1j * self.axis, 0.0)]

    def loss(self, x):
        return self.f * np.abs(x[0] * self.rubbing(np.sign(x[0])))


@dataclass
class Line:
    """Unknown force along a direction, from the first body on the second."""

    first: str
    second: str
    at: Any
    axis: Any
    size = 1

    def columns(self):
        return [(self.axis, 0.0)]

    def friction(self, x):
        return [(0.0, self.at, 0.0)]

    def loss(self, x):
        return 0 * x[0]


@dataclass
class Couple:
    """Unknown moment, from the first body on the second."""

    first: str
    second: str
    size = 1
    at = 0.0

    def columns(self):
        return [(0.0, 1.0)]

    def friction(self, x):
        return [(0.0, 0.0, 0.0)]

    def loss(self, x):
        return 0 * x[0]


@dataclass
class Tooth:
    """Mesh: the transmitted force along a line of action that pushes the teeth apart.

    ``tangent`` is the direction of the force on the second wheel when the unknown is positive,
    ``apart`` the direction in which the second wheel is pushed away from the first. ``share`` is
    the part of the power that the mesh takes from what enters it, ``rolling`` the speed of the
    pitch point along ``tangent``, seen from the carrier.
    """

    first: str
    second: str
    at: Any
    tangent: Any
    apart: Any
    angle: float
    rolling: Any = 0.0
    share: float = 0.0
    size = 1

    def columns(self):
        return [(self.tangent, 0.0)]

    def friction(self, x):
        side = np.sign(x[0])
        push = side * np.tan(LONG(self.angle)) * self.apart
        return [(push, self.at, 0.0)]

    def loss(self, x):
        return self.share * np.abs(x[0] * self.rolling)


@dataclass
class Scene:
    """Bodies, joints, known loads (body, place, force, moment)."""

    count: int
    masses: dict[str, Mass]
    joints: dict[str, Any]
    loads: list[tuple[str, Any, Any, Any]] = field(default_factory=list)
    gravity: complex = 0.0

    def equations(self) -> tuple[np.ndarray, np.ndarray]:
        size = sum(joint.size for joint in self.joints.values())
        assert size == 3 * len(self.masses), (size, len(self.masses))
        matrix = np.zeros((self.count, size, size), LONG)
        column = 0
        for joint in self.joints.values():
            for force, turn in joint.columns():
                self._put(matrix, column, joint, force, joint.at, turn)
                column += 1
        right = np.zeros((self.count, size), LONG)
        for name, mass in self.masses.items():
            inertial = LONG(mass.mass) * (mass.acceleration - self.gravity)
            turn = moment(mass.center, inertial) + LONG(mass.inertia) * mass.turning
            self._add(right, name, inertial, turn)
        for body, at, force, turn in self.loads:
            self._add(right, body, -force, -moment(at, force) - turn)
        return matrix, right

    def _rows(self, body: str) -> int:
        return 3 * list(self.masses).index(body)

    def _add(self, right, body, force, turn) -> None:
        if body == "ground":
            return
        row = self._rows(body)
        right[:, row] += np.real(force)
        right[:, row + 1] += np.imag(force)
        right[:, row + 2] += turn

    def _put(self, matrix, column, joint, force, at, turn) -> None:
        whole = moment(at, force) + turn
        for body, sign in ((joint.second, 1), (joint.first, -1)):
            if body != "ground":
                row = self._rows(body)
                matrix[:, row, column] += sign * np.real(force)
                matrix[:, row + 1, column] += sign * np.imag(force)
                matrix[:, row + 2, column] += sign * whole

    def with_friction(self, matrix: np.ndarray, x: np.ndarray) -> np.ndarray:
        result = matrix.copy()
        column = 0
        for joint in self.joints.values():
            part = [x[:, column + k] for k in range(joint.size)]
            for force, at, turn in joint.friction(part):
                self._put(result, column, joint, force, at, turn)
                column += 1
        return result

    def solve(self, friction: bool = True, start: np.ndarray | None = None) -> Forces:
        """Return the solution that Newton's method reaches from the one without friction."""
        matrix, right = self.equations()
        x = solve_linear(matrix, right) if start is None else start
        if not friction:
            return Forces(self, x, False)
        for _ in range(60):
            new = solve_linear(self.with_friction(matrix, x), right)
            step = np.abs(new - x).max(axis=1) / np.abs(new).max(axis=1)
            x = new
            if np.all(step < 1e-17):
                return Forces(self, x, True)
        assert np.all(step < 1e-15), f"no convergence: {step.max()}"
        return Forces(self, x, True)

    def every_solution(self) -> list[Forces]:
        """Return all solutions at one pose without pin friction, contact side by contact side."""
        assert self.count == 1
        assert not any(isinstance(j, Pin) and np.any(j.rho != 0) for j in self.joints.values())
        matrix, right = self.equations()
        size = right.shape[1]
        sided, column = [], 0
        for joint in self.joints.values():
            if isinstance(joint, Guide | Slot | Tooth):
                sided.append((column, joint))
            column += joint.size
        found = []
        choices = []
        for _, joint in sided:
            tilting = isinstance(joint, Guide) and joint.half is not None
            # (normal, moment) of a short guide: which of them grips, and its sign
            choices.append([(1, 0), (-1, 0), (0, 1), (0, -1)] if tilting else [(1, 0), (-1, 0)])
        for pattern in product(*choices):
            trial = np.zeros((1, size), LONG)
            for (column, joint), (a, b) in zip(sided, pattern, strict=True):
                trial[0, column] = a
                if joint.size == 2:
                    trial[0, column + 1] = b * LONG(getattr(joint, "half", None) or 1)
            x = solve_linear(self.with_friction(matrix, trial), right)
            again = solve_linear(self.with_friction(matrix, x), right)
            if np.all(np.abs(again - x) <= 1e-15 * np.abs(x).max()):
                found.append(Forces(self, x, True))
        return found


@dataclass
class Forces:
    """The unknowns of a scene, named."""

    scene: Scene
    x: np.ndarray
    friction: bool

    def _part(self, name: str) -> list[np.ndarray]:
        column = 0
        for key, joint in self.scene.joints.items():
            if key == name:
                return [self.x[:, column + k] for k in range(joint.size)]
            column += joint.size
        raise KeyError(name)

    def __getitem__(self, name: str) -> np.ndarray:
        """Return the unknowns of a joint: complex force, (normal, moment), or a number."""
        part = self._part(name)
        joint = self.scene.joints[name]
        if isinstance(joint, Pin):
            return part[0] + 1j * part[1]
        return part[0] if joint.size == 1 else np.array(part)

    def reaction(self, name: str, about: Any = None) -> np.ndarray:
        """Return Fx, Fy, M of the whole action on the second body, M about ``about``."""
        joint, part = self.scene.joints[name], self._part(name)
        point = joint.at if about is None else about
        force, turn = 0.0 + 0j, 0.0
        frictions = joint.friction(part) if self.friction else [(0.0, 0.0, 0.0)] * joint.size
        if isinstance(joint, Tooth):  # its push apart is no friction
            frictions = joint.friction(part)
        for value, (f, m), (g, at, n) in zip(part, joint.columns(), frictions, strict=True):
            force = force + value * (f + g)
            turn = turn + value * (
                moment(joint.at - point, f * (1 + 0j)) + m + moment(at - point, g * (1 + 0j)) + n
            )
        one = np.ones(self.scene.count, LONG)
        return np.stack([np.real(force) * one, np.imag(force) * one, turn * one], axis=1)

    def loss(self, name: str) -> np.ndarray:
        """Return the power lost in a joint, by the law with these normal forces."""
        return self.scene.joints[name].loss(self._part(name))


# -- kinematics ------------------------------------------------------------------------------------


def course(angle: Any, speed: Any, acceleration: Any = 0.0) -> Jet:
    """Return a driver's angle as a series in time."""
    angle = np.atleast_1d(np.asarray(angle, LONG))
    one = np.ones_like(angle)
    return Jet([angle, LONG(speed) * one, LONG(acceleration) * one / 2])


def place(series: Jet) -> np.ndarray:
    return series.c[0]


def rate(series: Jet) -> np.ndarray:
    return series.c[1]


def second(series: Jet) -> np.ndarray:
    return 2 * series.c[2]


def mass_of(mass: float, inertia: float, center: Jet, angle: Jet | None = None) -> Mass:
    turning = second(angle) if angle is not None else 0.0
    return Mass(mass, inertia, place(center), second(center), turning)


# -- slider-crank ----------------------------------------------------------------------------------


def slider_crank(
    theta: Any,
    omega: float,
    r: float,
    l: float,  # noqa: E741
    load: Any,
    rho: tuple[Any, Any, Any] = (0.0, 0.0, 0.0),
    f: float = 0.0,
    half: float | None = None,
    m_rod: float = 0.0,
    I_rod: float = 0.0,
    c_rod: float = 0.0,
    m_slider: float = 0.0,
    gravity: complex = 0.0,
    acceleration: float = 0.0,
) -> tuple[Scene, dict[str, Jet]]:
    """Slider-crank O-B-C on +x, slider at C; ``load(v)`` is the force on the slider along +x."""
    u = course(theta, omega, acceleration)
    one = unit(u)
    B = one * LONG(r)
    C, slide = circle_line(B, LONG(l), 0j, 1.0, 1)
    along = (C - B) * (1 / LONG(l))
    rod = arg(along)
    spin_c = -rate(rod)
    scene = Scene(
        len(place(u)),
        {
            "crank": Mass(),
            "rod": mass_of(m_rod, I_rod, B + along * LONG(c_rod), rod),
            "slider": mass_of(m_slider, 0.0, C),
        },
        {
            "O": Pin("ground", "crank", 0j, rate(u), rho[0]),
            "B": Pin("crank", "rod", place(B), rate(rod) - rate(u), rho[1]),
            "C": Pin("rod", "slider", place(C), spin_c, rho[2]),
            "slide": Guide("ground", "slider", place(C), 1.0 + 0j, rate(slide), f, half),
            "T": Couple("ground", "crank"),
        },
        [("slider", place(C), load(rate(slide)) + 0j, 0.0)],
        gravity,
    )
    return scene, {"crank": u, "rod": rod, "slide": slide}


# -- quick-return ----------------------------------------------------------------------------------


def quick_return(
    phi: Any,
    block: bool,
    omega: float = 8.0,
    OA: float = 0.08,
    OG: float = 0.2,
    load: float = 30.0,
    radii: tuple[float, float, float] = (0.020, 0.012, 0.018),
    f: float = 0.1,
    f_slot: float = 0.15,
) -> tuple[Scene, dict[str, Any]]:
    """Crank O-A, slotted rod about G = (0, -OG); with a block on its own pin, or the pin alone."""
    u = course(phi, omega)
    A = unit(u) * LONG(OA)
    G = -1j * LONG(OG)
    along, slide = slotted_link(G + 0 * A, A)
    rod = arg(along, near=np.pi / 2)
    w1, w3 = rate(u), rate(rod)
    rho = [circle(radius, f) for radius in radii]
    joints: dict[str, Any] = {"O": Pin("ground", "crank", 0j, w1, rho[0])}
    masses = {"crank": Mass(), "rod": Mass()}
    if block:
        masses["block"] = Mass()
        joints["A"] = Pin("crank", "block", place(A), w3 - w1, rho[1])
        joints["slot"] = Guide("rod", "block", place(A), place(along), rate(slide), f_slot)
    else:
        joints["slot"] = Slot(
            "rod", "crank", place(A), place(along), rate(slide), w1 - w3, f_slot, LONG(radii[1])
        )
    joints["G"] = Pin("ground", "rod", G, w3, rho[2])
    joints["T"] = Couple("ground", "crank")
    scene = Scene(len(place(u)), masses, joints, [("rod", G, 0j, -load * np.sign(w3))])
    return scene, {
        "w1": w1,
        "w3": w3,
        "slide": place(slide),
        "slide_speed": rate(slide),
        "rod": rod,
    }


# -- four-bar with uniform links -------------------------------------------------------------------


def four_bar(
    theta: Any,
    omega: float,
    s: float,
    density: float,
    g: float = 9.81,
    lengths: tuple[float, float, float, float] = (1.0, 3.0, 2.5, 3.2),
    sign: int = -1,
) -> tuple[Scene, dict[str, Jet]]:
    """Four-bar O-A-B-D of uniform rods; ``sign`` +1: B lies left of the line from A to D."""
    a, b, c, d = (LONG(x) * LONG(s) for x in lengths)
    u = course(theta, omega)
    A = unit(u) * a
    D = d + 0 * A
    B = circle_circle(A, b, D, c, sign)
    coupler, rocker = arg(B - A), arg(B - D, near=np.pi / 2 * sign)

    def rod(p: Jet, q: Jet, length: Any, angle: Jet) -> Mass:
        mass = LONG(density) * length
        return mass_of(mass, mass * length * length / 12, (p + q) * LONG(0.5), angle)

    scene = Scene(
        len(place(u)),
        {
            "crank": rod(0 * A, A, a, u),
            "coupler": rod(A, B, b, coupler),
            "rocker": rod(D, B, c, rocker),
        },
        {
            "O": Pin("ground", "crank", 0j),
            "A": Pin("crank", "coupler", place(A)),
            "B": Pin("coupler", "rocker", place(B)),
            "D": Pin("ground", "rocker", place(D)),
            "T": Couple("ground", "crank"),
        },
        [],
        -1j * LONG(g),
    )
    return scene, {"crank": u, "coupler": coupler, "rocker": rocker, "A": A, "B": B}


# -- seven-link mechanism ----------------------------------------------------------------------


def seven_link(phi: Any, omega: float = -4.0, friction: bool = True) -> Scene:
    """Forces of `seven-link-forces`, with the dimensions of `closed_forms.gorshkov_seven_link`."""
    q, m_block, m_slider, load, drag = 12.0, 1.5, 8.0, 900.0, 60.0
    f, f_slot, f_guide = (0.1, 0.12, 0.08) if friction else (0.0, 0.0, 0.0)
    rho = circle(0.02, f)
    u = course(phi, omega)
    at = gorshkov_seven_link(u)
    spins = {name: rate(at[name]) for name in
             ("crank", "block", "rod", "connecting_rod", "coupler", "rocker")}  # fmt: skip
    spins |= {"ground": 0 * place(u), "slider": 0 * place(u)}

    def bar(name: str, tail: str, head: str, length: float) -> Mass:
        mass = LONG(q) * LONG(length)
        middle = (at[tail] + at[head]) * LONG(0.5)
        return mass_of(mass, mass * LONG(length) ** 2 / 12, middle, at[name])

    def pin(first: str, second: str, point: str) -> Pin:
        return Pin(first, second, place(at[point]), spins[second] - spins[first], rho)

    along = place(unit(at["rod"]))
    return Scene(
        len(place(u)),
        {
            "crank": Mass(),
            "block": mass_of(m_block, 0.002, at["block.A"], at["block"]),
            "rod": bar("rod", "rod.G", "rod.B", 0.8342),
            "connecting_rod": bar("connecting_rod", "connecting_rod.B", "connecting_rod.C", 0.5179),
            "slider": mass_of(m_slider, 0.0, at["slider.C"]),
            "coupler": bar("coupler", "coupler.B", "coupler.E", 0.54),
            "rocker": bar("rocker", "rocker.F", "rocker.E", 0.3013),
        },
        {
            "O": pin("ground", "crank", "crank.O"),
            "A": pin("crank", "block", "crank.A"),
            "slot": Guide("rod", "block", place(at["block.A"]), along, rate(at["slot"]), f_slot),
            "G": pin("ground", "rod", "rod.G"),
            "BC": pin("rod", "connecting_rod", "rod.B"),
            "BE": pin("rod", "coupler", "rod.B"),
            "C": pin("connecting_rod", "slider", "slider.C"),
            "guide": Guide(
                "ground", "slider", place(at["slider.C"]), 1.0 + 0j, rate(at["guide"]), f_guide
            ),
            "E": pin("rocker", "coupler", "coupler.E"),
            "F": pin("ground", "rocker", "rocker.F"),
            "T": Couple("ground", "crank"),
        },
        [
            ("slider", place(at["slider.C"]), -load * np.sign(rate(at["guide"])) + 0j, 0.0),
            ("rocker", place(at["rocker.F"]), 0j, -drag * np.sign(spins["rocker"])),
        ],
        -1j * LONG(9.81),
    )


# -- mean values -----------------------------------------------------------------------------------


def panels(kinks: list[float], pieces: int = 1, nodes: int = 24) -> tuple[np.ndarray, np.ndarray]:
    """Return Gauss points and weights of the mean over consecutive panels between kinks."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    edges = np.concatenate(
        [np.linspace(a, b, pieces, endpoint=False) for a, b in pairwise(kinks)]
        + [np.array([kinks[-1]])]
    )
    low, wide = edges[:-1, None], np.diff(edges)[:, None]
    at = low + wide * (x + 1) / 2
    return at.ravel(), (wide * w / 2).ravel() / (kinks[-1] - kinks[0])
