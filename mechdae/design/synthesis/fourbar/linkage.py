"""A four-bar that moves a plane through poses, read from the places of its joints.

What exact synthesis finds: it assembles at every target, which says nothing about the way
between them. ``faults`` names what closed forms tell about that way.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.design.synthesis.fourbar.projection import StartingFourBar
from mechdae.records import dataclass
from mechdae.types import Complexes, Floats

TURN = 2 * np.pi
LEAST = 1e-12
"""Cosine range and signs nearer to their limit are taken for the limit."""


@dataclass(frozen=True)
class Linkage(StartingFourBar):
    """A start whose poses are exact.

    Beyond `StartingFourBar`: ``branches`` (k,) signs of sin(theta4 - theta3) at the poses,
    ``branch`` is their common sign or 0; ``sense`` is the sense in which the crank visits the
    poses in order, or 0 where neither does; ``frame`` the direction of the line from crank to
    rocker pin in the moving plane, where poses have one.
    """

    branches: Floats
    frame: float = 0.0

    @property
    def other_pivot(self) -> complex:
        """Fixed pivot of the rocker."""
        return complex(self.pivot + self.lengths[0] * np.exp(1j * self.turn))

    def points(self) -> Any:
        """Return the coupler point (k,) from lengths and crank angles alone."""
        crank, coupler, _ = self._links()
        return self.pivot + np.exp(1j * self.turn) * (crank + self.point * coupler)

    def _links(self) -> tuple[Complexes, Complexes, Complexes]:
        """Return crank pin, unit vectors of the coupler, rocker pin in the ground frame."""
        r1, r2, r3, r4 = self.lengths
        crank = r2 * np.exp(1j * self.turns)
        d = r1 - crank
        size = np.abs(d)
        cosine = np.clip((size**2 + r3**2 - r4**2) / (2 * size * r3), -1, 1)
        coupler = d / size * np.exp(1j * self.branches * np.arccos(cosine))
        return crank, coupler, crank + r3 * coupler


def linkage(
    pivot: complex, other: complex, A: Complexes, B: Complexes, P: Complexes, frame: float = 0.0
) -> Linkage:
    """Return the four-bar with crank pins `A` (k,), rocker pins `B` and coupler points `P`."""
    ground = other - pivot
    along = ground / abs(ground)
    crank, rocker, coupler = (A - pivot) / along, (B - other) / along, (B - A) / along
    lengths = np.array([abs(ground), *(np.abs(v).mean() for v in (crank, coupler, rocker))])
    point = complex(np.mean((P - A) / (B - A)) * lengths[2])
    branches = np.sign((rocker * coupler.conj()).imag)
    turns, sense = visited(np.angle(crank))
    made = Linkage(
        lengths, complex(pivot), float(np.angle(ground)), point, turns,
        np.unwrap(np.angle(coupler)), np.unwrap(np.angle(rocker)),
        int(branches[0]) if (branches == branches[0]).all() else 0, sense, 0.0, branches, frame,
    )  # fmt: skip
    left = made.points() - P
    object.__setattr__(made, "residual", float(np.sum(np.abs(left) ** 2)))
    for array in (made.lengths, made.turns, made.couplers, made.rockers, made.branches):
        array.flags.writeable = False
    return made


def visited(turns: Floats) -> tuple[Floats, int]:
    """Return angles unwrapped in the sense in which they follow each other within a turn.

    The second is that sense, 0 where neither is: then each angle is near the one before.
    """
    steps = np.diff(turns)
    for sense in (1, -1):
        onward = np.mod(sense * steps, TURN)
        if onward.sum() < TURN:
            return turns[0] + sense * np.concatenate([[0.0], np.cumsum(onward)]), sense
    return np.unwrap(turns), 0


def swapped(design: Linkage) -> Linkage:
    """Return the same four-bar driven at its other pivot."""
    A, B, P = joints(design)
    frame = float(np.angle(-np.exp(1j * design.frame)))
    return linkage(design.other_pivot, design.pivot, B, A, P, frame)


def joints(design: Linkage) -> tuple[Complexes, Complexes, Complexes]:
    """Return crank pins, rocker pins and coupler points (k,) from the angles of the links."""
    _, r2, _, r4 = design.lengths
    turn = np.exp(1j * design.turn)
    A = design.pivot + turn * r2 * np.exp(1j * design.turns)
    B = design.other_pivot + turn * r4 * np.exp(1j * design.rockers)
    P = A + turn * design.point * np.exp(1j * design.couplers)
    return A, B, P


def kind(lengths: Any) -> str:
    """Return Grashof's class: crank-rocker, drag-link, double-, triple-rocker or rocker-crank."""
    s = np.sort(lengths)
    if s[0] + s[3] > s[1] + s[2]:
        return "triple-rocker"
    return ("drag-link", "crank-rocker", "double-rocker", "rocker-crank")[int(np.argmin(lengths))]


def transmission(design: Linkage) -> float:
    """Return the least transmission angle [rad]: over the turn, or at the poses without one."""
    r1, r2, r3, r4 = design.lengths
    if kind(design.lengths) in ("crank-rocker", "drag-link"):
        d2 = np.array([(r1 - r2) ** 2, (r1 + r2) ** 2])
    else:
        d2 = np.abs(r1 - r2 * np.exp(1j * design.turns)) ** 2
    cosine = np.abs(r3**2 + r4**2 - d2) / (2 * r3 * r4)
    return float(np.arccos(min(float(cosine.max()), 1.0)))


def faults(design: Linkage, full_turn: bool = True) -> tuple[str, ...]:
    """Return what is wrong with the motion between the poses, () for a sound four-bar.

    "branch": the poses are on both sides of the dead points; "order": the crank does not visit
    them in order within a turn; "full turn": it does not turn fully; "circuit": it does not
    assemble on its way (asked where a full turn is not).
    """
    found = []
    if design.branch == 0:
        found.append("branch")
    if design.sense == 0:
        found.append("order")
    turning = kind(design.lengths) in ("crank-rocker", "drag-link")
    if full_turn and not turning:
        found.append("full turn")
    elif not turning and not _assembles(design):
        found.append("circuit")
    return tuple(found)


def _assembles(design: Linkage) -> bool:
    """Whether the loop closes over the whole arc of the crank between first and last pose."""
    r1, r2, r3, r4 = design.lengths
    low, high = float(design.turns.min()), float(design.turns.max())
    ends = [low, high, *np.pi * np.arange(np.ceil(low / np.pi), np.floor(high / np.pi) + 1)]
    d = np.abs(r1 - r2 * np.exp(1j * np.array(ends)))
    slack = LEAST * float(np.max(design.lengths))
    return bool((d >= abs(r3 - r4) - slack).all() and (d <= r3 + r4 + slack).all())
