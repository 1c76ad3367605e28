"""Lengths of paths behind a pin in a slot, which turn back and nearly so, beside own quadrature.

    python -m tests.attack.slotted_curves --count 130

A crank's pin leads a slotted lever, the lever a dyad. Places are closed forms; speeds are their
differences in 80 bits, integrated by Gauss between the places where the speed is least, in pieces
that halve towards them. The exit code is 1 where a length is 1e-7 of it off.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

import mechdae as md
from tests.shared import attack

CLOSE = 1e-7
GRID, HALVES, NODES = 8001, 30, 12


class Slotted:
    """A crank, a lever with a slot, a coupler and a rocker, drawn at random."""

    def __init__(self, seed: int) -> None:
        draw = np.random.default_rng([seed, 77])

        def turned(low: float, high: float, most: float = 3.0) -> complex:
            return complex(draw.uniform(low, high) * np.exp(1j * draw.uniform(-most, most)))

        self.crank = draw.uniform(0.2, 0.9)
        self.pivot = turned(1.0, 1.6)
        self.offset = float(draw.choice([0.0, draw.uniform(-0.09, 0.09)]))
        self.arm = turned(0.5, 1.5, 1.0)
        self.fixed = self.pivot + turned(1.0, 2.5)
        self.coupler, self.rocker = draw.uniform(1, 3, 2)
        self.side = int(draw.choice([-1, 1]))
        self.on_coupler, self.on_lever = turned(0.0, 2.0), turned(0.2, 1.5)
        self.poses = int(draw.integers(5, 40))

    def angles(self, phi: Any) -> tuple[Any, Any, Any]:
        """Return directions of lever, coupler and rocker, nan where they do not close."""
        pin = self.crank * np.exp(1j * phi) - self.pivot
        slide = np.sqrt(np.abs(pin) ** 2 - self.offset**2)
        lever = pin / (slide + 1j * self.offset)
        end = self.pivot + lever * self.arm
        way = self.fixed - end
        far = np.abs(way)
        along = (self.coupler**2 - self.rocker**2 + far**2) / (2 * far)
        up = np.sqrt(self.coupler**2 - along**2)
        joint = end + way / far * (along + self.side * 1j * up)
        return lever, (joint - end) / self.coupler, (joint - self.fixed) / self.rocker

    def points(self) -> dict[str, Callable[[Any], Any]]:
        """Return the places of points by the crank's angle."""

        def on_coupler(phi: Any) -> Any:
            lever, coupler, _ = self.angles(phi)
            return self.pivot + lever * self.arm + coupler * self.on_coupler

        return {
            "coupler.P": on_coupler,
            "lever.Q": lambda phi: self.pivot + self.angles(phi)[0] * self.on_lever,
        }

    def span(self) -> tuple[float, float] | None:
        """Return a range of the crank over which all closes: a turn, or an arc inside of one."""
        phi = np.linspace(0, 2 * math.pi, 721)
        with np.errstate(invalid="ignore"):
            there = np.isfinite(self.angles(phi)[1])
        if there.all():
            return 0.0, 2 * math.pi
        edges = np.flatnonzero(np.diff(np.concatenate([[0], there.astype(int), [0]])))
        arcs = [(a + 3, b - 4) for a, b in zip(edges[::2], edges[1::2], strict=True)]
        first, last = max(arcs, key=lambda own: own[1] - own[0], default=(0, 0))
        return (float(phi[first]), float(phi[last])) if last - first >= 40 else None

    def mechanism(self, phi: float) -> md.Mechanism:
        """Return the mechanism, sketched at one pose."""
        angles = [float(np.angle(own)) for own in self.angles(phi)]

        def place(z: complex) -> tuple[float, float]:
            return (z.real, z.imag)

        ends = {
            "O": ("ground.O", "crank.O"), "G": ("ground.G", "lever.G"),
            "B": ("lever.B", "coupler.B"), "C": ("coupler.C", "rocker.C"),
            "D": ("ground.D", "rocker.D"),
        }  # fmt: skip
        return md.Mechanism(
            ground=md.Ground({"O": (0, 0), "G": place(self.pivot), "D": place(self.fixed)}),
            bodies=[
                md.Body("crank", {"O": (0, 0), "A": (self.crank, 0)}),
                md.Body("lever", {"G": (0, 0), "S": (0, self.offset), "B": place(self.arm),
                                  "Q": place(self.on_lever)}),
                md.Body("coupler", {"B": (0, 0), "C": (self.coupler, 0),
                                    "P": place(self.on_coupler)}),
                md.Body("rocker", {"D": (0, 0), "C": (self.rocker, 0)}),
            ],
            joints=[
                md.PinInSlot("slot", "lever.S", "crank.A"),
                *(md.Revolute(name, *own) for name, own in ends.items()),
            ],
            sketch=dict(zip(("crank", "lever", "coupler", "rocker"), (phi, *angles), strict=True)),
        )  # fmt: skip


def length_of(place: Callable[[Any], Any], low: float, high: float) -> float:
    """Return the length of a path."""
    step = np.longdouble(1e-5)

    def speed(phi: Any) -> Any:
        near, far = (place(phi + k * step) - place(phi - k * step) for k in (1, 2))
        return np.abs(8 * near - far) / (12 * step)

    grid = np.linspace(low, high, GRID).astype(np.longdouble)
    v = speed(grid)
    cuts = [low]
    for k in np.flatnonzero((v[1:-1] < v[:-2]) & (v[1:-1] <= v[2:])) + 1:
        a, b = grid[k - 1], grid[k + 1]
        for _ in range(60):
            third = (b - a) / 3
            a, b = (a, b - third) if speed(a + third) < speed(b - third) else (a + third, b)
        cuts.append(float((a + b) / 2))
    halves = 0.5 ** np.arange(HALVES, 0, -1)
    shares = np.concatenate([[0.0], halves, 1 - halves[-2::-1], [1.0]])
    edges = np.concatenate(
        [a + (b - a) * shares for a, b in zip(cuts, [*cuts[1:], high], strict=True)]
    )
    fine = np.unique(np.concatenate([edges, np.linspace(low, high, 200)]))
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    middle, half = (fine[1:] + fine[:-1]) / 2, (fine[1:] - fine[:-1]) / 2
    phi = (middle[:, None] + half[:, None] * nodes).astype(np.longdouble)
    return float(np.sum(speed(phi) * weights * half[:, None]))


def examine(seed: int) -> dict[str, float] | None:
    """Return by point how far its length is off, as a share; None where too little closes."""
    drawn = Slotted(seed)
    span = drawn.span()
    if span is None:
        return None
    driver = md.Driver("crank.angle", from_=span[0], to=span[1])
    task = md.Sweep(driver, poses=drawn.poses, measures=("curve",))
    result = md.solve(drawn.mechanism(sum(span) / 2), task)
    if set(result.status) != {"ok"}:
        return {"status": math.inf}
    found = {}
    for name, place in drawn.points().items():
        length = length_of(place, *span)
        found[name] = abs(result.summary["curve"][name]["length"] / length - 1)
    return found


def main() -> int:
    options = attack.parser(__doc__ or "", 130, "mechanisms").parse_args()
    jobs = [(seed,) for seed in range(options.seed, options.seed + options.count)]
    compared, worst, wrong = 0, 0.0, []
    with attack.processes(options.workers) as run:
        for (seed,), found in zip(jobs, run(examine, jobs), strict=True):
            shares = found or {}
            compared, worst = compared + len(shares), max([worst, *shares.values()])
            if any(not share < CLOSE for share in shares.values()):
                wrong.append({"seed": seed, **shares})
    figures = {"lengths": compared, "worst": worst, "wrong": wrong}
    return attack.ended(figures, options.out, wrong)


if __name__ == "__main__":
    sys.exit(main())
