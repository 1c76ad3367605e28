"""Pressure, sliding speed and their product in contacts, over poses and along a cycle.

Along a cycle peaks and means are those of the motion, not of its poses: formulas of forces change
at kinks, between which peaks are narrowed and integrals taken by adaptive quadrature.

Contacts as surfaces: how large they are, how they are curved, how fast they slide.

Pins, blocks and shoes bear on an area (a pin on its projection), and their pressure is the mean
one. A tip on a curve and a pin in a slot touch along a line: the pressure in its middle is that of
Hertz for cylinders, p = sqrt(F E' / (2 pi w R)), 1/R the sum of both curvatures, positive where
convex, 2/E' = (1 - nu1^2)/E1 + (1 - nu2^2)/E2 (K. L. Johnson, Contact Mechanics, 1985, ch. 4).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import casadi as ca
import numpy as np

from mechdae.describe.joints.joint import Joint
from mechdae.equations.forces.friction import (
    place_on_curve,
    place_on_pin,
    sliding_speed,
    tangent_of,
)
from mechdae.equations.forces.generalised import spin
from mechdae.equations.joints import Ends
from mechdae.equations.model import Model
from mechdae.forces.cycle import interval
from mechdae.forces.formula_changes import SAMPLES, State, fastest, kinks_of
from mechdae.forces.inverse_dynamics import InverseDynamics, Loaded, LoadedPoses
from mechdae.forces.poses import LoadedRun, PoseForces
from mechdae.forces.uniqueness import Uniqueness
from mechdae.kernels.graphs.kinetostatics import SPEEDS
from mechdae.numerics.changes import Guide, narrowed
from mechdae.numerics.quadrature import Substitution, integrate
from mechdae.records import dataclass
from mechdae.results.series import LazyPart, Summary
from mechdae.types import Floats, Integers, Json, Sym

SX = ca.SX
NOTHING = 1e-12
"""Share of the largest force, or speed, of the mechanism that is rounding."""


@dataclass(frozen=True)
class Surface:
    """A contact in symbols.

    ``left``, ``right``: sliding speeds [m/s] while the first body is on the right or on the left
    of the second, and pushes it to the other side. ``tip``, ``curve``: curvatures [1/m] of the
    second body's surface, and of the first one's, positive with its centre on the left. ``stiff``:
    E'/(2 pi w), 0 of flat contacts; ``area``: that of a flat contact, else 1. ``arm``: what a
    moment is multiplied by to press like a force [1/m]. ``side``: on which the second body lies
    whatever presses, 0 where the force tells it.
    """

    left: Sym
    right: Sym
    area: Sym
    stiff: Sym = SX(0)
    tip: Sym = SX(0)
    curve: Sym = SX(0)
    arm: Sym = SX(0)
    side: Sym = SX(0)

    @property
    def column(self) -> Sym:
        """All of it (8,)."""
        return ca.vertcat(*[SX(value) for value in vars(self).values()])


def _pin(model: Model, ends: Ends) -> Surface:
    joint = ends.joint
    turning = spin(model, joint.second_body) - spin(model, joint.first_body)
    speed = ends.number("pin_radius") * turning
    return Surface(speed, speed, 2 * ends.number("pin_radius") * ends.number("face_width"))


def _block(model: Model, ends: Ends) -> Surface:
    speed = sliding_speed(model, ends, ends.axis(), ends.p2)
    length = ends.number("contact_length")
    return Surface(speed, speed, length * ends.number("face_width"), arm=2 / length)


def _in_slot(model: Model, ends: Ends) -> Surface:
    axis = ends.axis()
    if getattr(ends.joint, "shoe_length", None) is not None:
        speed = sliding_speed(model, ends, axis, ends.p2)
        return Surface(speed, speed, ends.number("shoe_length") * ends.number("face_width"))
    radius = ends.number("pin_radius")
    left, right = (
        sliding_speed(model, ends, axis, place_on_pin(ends, side, radius)) for side in (1, -1)
    )
    return Surface(left, right, SX(1), _stiffness(ends), 1 / radius)


def _on_curve(model: Model, ends: Ends) -> Surface:
    contact, joint = ends.contact, ends.joint
    assert contact is not None
    first = contact.tangent
    second = ca.jacobian(first, contact.s) * contact.turn
    curve = (first[0] * second[1] - first[1] * second[0]) / ca.sumsqr(first) ** 1.5
    rounding = "roller_radius" if contact.rolls else "tip_radius"
    turns = contact.rolls and contact.joint.friction is None
    speed = SX(0) if turns else sliding_speed(model, ends, tangent_of(ends), place_on_curve(ends))
    side = getattr(joint, "one_sided", None) or (contact.joint.side if contact.rolls else "")
    sign = SX({"left": 1, "right": -1}.get(side, 0))
    tip = 1 / ends.number(rounding)
    return Surface(speed, speed, SX(1), _stiffness(ends), tip, curve, side=sign)


def _stiffness(ends: Ends) -> Sym:
    return ends.number("contact_modulus") / (2 * math.pi * ends.number("face_width"))


SURFACES: dict[str, Callable[[Model, Ends], Surface]] = {
    "revolute": _pin,
    "prismatic": _block,
    "pin-in-slot": _in_slot,
    "curve": _on_curve,
}


class Surfaces:
    """The contacts of a scene whose surfaces are given, as functions of poses and forces.

    `motion`, `loaded`: poses that tell forces and speeds from rounding: up to ``loose`` [N] and
    ``still`` [m/s] they are none.
    """

    def __init__(
        self, statics: InverseDynamics, names: list[str], motion: LoadedPoses, loaded: Loaded
    ) -> None:
        self.statics: InverseDynamics = statics
        self.names: list[str] = names
        self.still: float = NOTHING * fastest(statics, motion)
        forces = np.nan_to_num(loaded.reactions[..., :2])
        self.loose: float = NOTHING * float(np.abs(forces).max(initial=0.0))
        balance, joints = statics.balance, statics.scene.model.mechanism.joints
        self._rows = [balance.joints.index(name) for name in names]
        self._hinges = np.array([joints[name].hinge for name in names])
        guides = balance.guides
        self._guides = [guides.index(n) if n in guides else -1 for n in names]

    def parts(self, motion: LoadedPoses, loaded: Loaded) -> tuple[Floats, Floats, Floats, Floats]:
        """Return numbers of surfaces (n, k, 8), normal forces, pressing forces and speeds (n, k).

        The normal force is that on the second body, positive towards its left, 0 of pins; the
        pressing one is what friction multiplies.
        """
        statics, model = self.statics, self.statics.scene.model

        def build() -> object:
            joints = model.mechanism.joints
            every = [SURFACES[joints[n].kind](model, model.ends[n]).column for n in self.names]
            return statics.balance.function("surfaces", [ca.densify(ca.vertcat(*every))], SPEEDS)

        batch = statics.batch(f"surfaces {' '.join(self.names)}", build, SPEEDS)
        values = batch(motion.w, motion.v, statics.p)[0]
        width = 8 * len(self.names)
        numbers = np.broadcast_to(values, (len(motion), width)).reshape(len(motion), -1, 8)
        reactions = loaded.reactions[:, self._rows]
        across = np.zeros((len(motion), 1))
        normals = np.hstack([loaded.normals, across])[:, self._guides]
        force = np.where(self._hinges, np.hypot(reactions[..., 0], reactions[..., 1]), 0.0)
        force = np.maximum(force, np.maximum(np.abs(normals), self._tilting(numbers, reactions)))
        speeds = np.where(normals >= 0, numbers[..., 0], numbers[..., 1])
        force = np.where(force <= self.loose, 0.0, force)
        speeds = np.where(np.abs(speeds) <= self.still, 0.0, speeds)
        return numbers, normals, force, speeds

    @staticmethod
    def _tilting(numbers: Floats, reactions: Floats) -> Floats:
        """Return the moments as forces at the two ends of a block, (n, k)."""
        return np.abs(reactions[..., 2]) * numbers[..., 6]

    def at(self, motion: LoadedPoses, loaded: Loaded) -> Floats:
        """Return pressure [Pa], sliding speed [m/s] and their product [W/m^2], (n, k, 3).

        nan where a tip is no more curved than the hollow in which it lies: no line of contact.
        """
        numbers, normals, force, speeds = self.parts(motion, loaded)
        area, stiff, tip, curve = (numbers[..., i] for i in range(2, 6))
        side = np.where(numbers[..., 7] == 0, np.sign(normals), numbers[..., 7])
        hertz = stiff * force * (tip - side * curve)
        with np.errstate(invalid="ignore"):
            pressure = np.where(stiff > 0, np.sqrt(hertz), force / area)
        speed = np.abs(speeds)
        return np.stack([pressure, speed, pressure * speed], axis=2)


def has_surface(joint: Joint) -> bool:
    """Return whether the pressure in a joint's contact follows from what is given."""
    return getattr(joint, "face_width", None) is not None


WORDS = ("pressure", "sliding_speed", "pv")
INSIDE = 1e-12
"""Share of its width by which one keeps inside an interval between kinks."""
LEAST = 8
"""Places in each of these, at least."""


def along(
    loaded: LoadedRun,
    answer: PoseForces,
    unique: Uniqueness | None,
    series: dict[str, dict[str, Floats]],
    summary: Summary,
) -> None:
    """Add pressure, sliding speed and wear of contacts to the series and summary of forces.

    The summary has them along a cycle that goes all the way without a jam: joint ->
    ``peak_pressure`` [Pa], ``peak_pv``, ``mean_pv`` [W/m^2], ``sliding_distance`` [m] over the
    cycle.
    """
    statics, joints = loaded.statics, loaded.setting.scene.model.mechanism.joints
    every = [name for name in statics.balance.joints if has_surface(joints[name])]
    names = [n for n in every if unique is None or unique.given(statics.balance, n, "reaction")]
    open_ones = ", ".join(name for name in every if name not in names)
    notes = [f"{open_ones}: no pressure, the reaction is not unique"] if open_ones else []
    if names:
        surfaces = Surfaces(statics, names, answer.motion, answer.whole)
        values = surfaces.at(answer.motion, answer.whole)
        values[~answer.standing] = np.nan
        notes += [
            f"joint {name}: its tip is less curved than the curve's hollow, it does not touch "
            "along one line and has no pressure of Hertz there"
            for k, name in enumerate(names)
            if np.isnan(values[answer.standing, k, 0]).any()
        ]
        for k, name in enumerate(names):
            series[name] |= dict(zip(WORDS, values[:, k].T, strict=True))
        if "kinks" in summary and not summary["jammed_arcs"]:
            summary["wear"] = LazyPart(lambda: {"wear": over_cycle(loaded, answer, surfaces)})
    if notes:
        summary["notes"] = [*summary.get("notes", []), *notes]


class WearState(State):
    """What decides which formula holds of contacts too: which side is pressed, where it slides."""

    def __init__(self, loaded: LoadedRun, answer: PoseForces, surfaces: Surfaces) -> None:
        super().__init__(loaded.statics, loaded.moving)
        self.surfaces, self.coupled = surfaces, answer.coupled

    def marks(self, here: PoseForces) -> tuple[Integers, Floats, list[Guide]]:
        marks, values, guides = super().marks(here)
        numbers, normals, force, speeds = self.surfaces.parts(here.motion, here.whole)
        tilts = np.where(numbers[..., 6] > 0, force - np.abs(normals), 0.0)
        loose = self.surfaces.loose
        pressed = (np.where(np.abs(part) > loose, part, 0.0) for part in (normals, tilts))
        added = np.hstack([*pressed, speeds])
        added = np.nan_to_num(added)
        start = values.shape[1]
        guides += [("sign", slice(start + k, start + k + 1)) for k in range(added.shape[1])]
        signs = np.sign(added).astype(int)
        return np.hstack([marks, signs]), np.hstack([values, added]), guides

    def wear(self, places: Floats) -> Floats:
        """Return pressures, sliding speeds and their products at places, (n, k, 3)."""
        here = self.at(places, self.coupled)
        return self.surfaces.at(here.motion, here.whole)


def over_cycle(loaded: LoadedRun, answer: PoseForces, surfaces: Surfaces) -> dict[str, Json]:
    """Return peaks, means and distances of contacts by joint."""
    state = WearState(loaded, answer, surfaces)
    low, high = interval(loaded.moving)
    kinks = [place for place in kinks_of(state, answer)[0] if low < place < high]
    panels = [(a, b) for a, b in itertools.pairwise([low, *kinks, high]) if b > a]
    peaks = _peaks(state, panels)

    def rates(places: Floats) -> Floats:
        return state.wear(places)[..., 1:].reshape(len(places), -1)

    charts = [Substitution(a, b) for a, b in panels]
    sizes = np.maximum(peaks[:, 1:].ravel() * (high - low), np.finfo(float).tiny)
    integrals, _ = integrate(rates, charts, np.abs, lambda _: sizes)
    speed = abs(loaded.moving.speed)
    contacts = {}
    for name, peak, (way, pv) in zip(
        surfaces.names, peaks, integrals.reshape(-1, 2).tolist(), strict=True
    ):
        contacts[name] = {
            "peak_pressure": float(peak[0]), "peak_pv": float(peak[2]),
            "mean_pv": pv / (high - low), "sliding_distance": way / speed,
        }  # fmt: skip
    return contacts


def _peaks(state: WearState, panels: list[tuple[float, float]]) -> Floats:
    """Return the largest values of all contacts, (k, 3), between kinks and at them."""
    whole = panels[-1][1] - panels[0][0]
    grids = []
    for a, b in panels:
        count = max(LEAST, int(np.ceil(SAMPLES * (b - a) / whole)))
        grids.append(np.linspace(a + INSIDE * (b - a), b - INSIDE * (b - a), count + 1))
    places = np.concatenate(grids)
    ends = np.cumsum([len(grid) for grid in grids])
    values = state.wear(places)
    shape = values.shape[1:]
    values = values.reshape(len(places), -1)
    if not np.isfinite(values).all(axis=0).any():
        return np.full(shape, np.nan)
    top = np.argmax(np.where(np.isfinite(values), values, -np.inf), axis=0)
    panel = np.searchsorted(ends, top, side="right")
    first = np.concatenate([[0], ends[:-1]])[panel]
    a, b = places[np.maximum(top - 1, first)], places[np.minimum(top + 1, ends[panel] - 1)]
    rows = np.arange(len(top))

    def look(at: Floats) -> Floats:
        every = state.wear(at.ravel()).reshape(*at.shape, -1)
        least: Floats = -every[rows, :, rows]
        return least

    best = -look(narrowed(look, a, b)[:, None])[:, 0]
    best = np.fmax(best, values[top, rows])
    best[~np.isfinite(values).all(axis=0)] = np.nan
    peaks: Floats = best.reshape(shape)
    return peaks
