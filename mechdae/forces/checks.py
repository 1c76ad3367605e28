"""The checks that come with forces: virtual power, energy along the path, balance of bodies.

The power balance of one pose is an identity of the equations that were solved: it finds a
force that does work where it should not, and nothing that is wrong in the accelerations. The
kinetic energy differenced along the path does: it uses speeds only.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from mechdae.continuation.follower import extend
from mechdae.continuation.path import Path
from mechdae.forces.inverse_dynamics import Loaded, Statics
from mechdae.forces.poses import Moving

PANELS = 6
WIDTHS = tuple(0.02 / 4**k for k in range(7))
"""Half widths of a panel [rad, or in the unit of the path's parameter], the next where the one
before holds a kink or is too wide for the quadrature."""
WELL = 30.0
"""Condition up to which poses are middles of panels in any case."""
RESOLVED = 1e-6
"""Share of the last Legendre coefficients in the largest one; the quadrature errs by its square."""
NODES, WEIGHTS = np.polynomial.legendre.leggauss(10)
LEGENDRE = np.polynomial.legendre.legvander(NODES, 9).T * WEIGHTS * (np.arange(10)[:, None] + 0.5)


def checks(statics: Statics, moving: Moving, answer: Any) -> dict[str, Any]:
    """Return the largest relative errors of the three checks.

    ``energy`` is None where there is no path to difference along. A number that is not finite
    where there should be forces makes a check not finite.
    """
    coupled = answer.whole is not answer.free
    rows = answer.there & ~answer.jammed
    return {
        "virtual_power": _power(answer.whole, rows, coupled),
        "energy": _energy(statics, moving, answer, coupled),
        "balance": _largest(answer.whole.imbalance[rows]),
    }


def _largest(values: Any) -> float:
    return float(np.max(np.abs(values), initial=0.0))


def _power(loaded: Loaded, rows: Any, coupled: bool) -> float:
    """Return the error of drivers + loads - losses = rate of the kinetic energy."""
    driven, loads, rate, _, sizes = loaded.powers[rows].T
    lost = loaded.losses[rows].sum(axis=1) if coupled else 0.0 * driven
    size = _largest(sizes + lost)
    return _largest(driven + loads - lost - rate) / size if size else 0.0


def _energy(statics: Statics, moving: Moving, answer: Any, coupled: bool) -> float | None:
    extend = bool(moving.run.path.graphs.nx)
    if not moving.speed:
        return None
    rows = np.flatnonzero(answer.there & ~answer.jammed & ~answer.ambiguous)
    if not rows.size:
        return None
    condition = moving.run.poses.condition[rows]
    rows = rows[condition <= max(WELL, 2 * float(np.median(condition)))]
    chosen = rows[np.linspace(0, len(rows) - 1, min(PANELS, len(rows))).astype(int)]
    plan = moving.setting.plan
    angular = moving.by_value and plan.coordinates[plan.lead].is_angle
    unit = 1.0 if angular else moving.run.path.largest * 20
    worst = None
    panels = itertools.product(moving.run.places[chosen], (False,))
    last = itertools.product(moving.run.places[chosen][:1], (True,)) if coupled else ()
    for centre, several in itertools.chain(panels, last):
        if several and worst is not None:
            break
        for half, side in itertools.product(WIDTHS, (0.0, 1.0, -1.0)):
            middle = float(centre) + 1.01 * side * half * unit
            found = _panel(statics, moving, middle, half * unit, coupled, several, extend)
            if found is not None:
                worst = max(found, worst or 0.0)
                break
    return worst


def _panel(
    statics: Statics,
    moving: Moving,
    middle: float,
    half: float,
    coupled: bool,
    several: bool,
    further: bool,
) -> float | None:
    """Return the relative error of the energy over one panel.

    None where it holds a kink or an end of the motion, or is too wide. Places that may have
    `several` solutions are looked at only if asked, one by one they take long.
    """
    path = moving.run.path
    if further and isinstance(path, Path):
        extend(path, middle + half)
        extend(path, middle - half)
    nodes = np.concatenate([[middle - half], middle + half * NODES, [middle + half]])
    motion = moving.at(nodes)
    if not np.isfinite(motion.a).all():
        return None
    inputs = statics.inputs(motion)
    signs = inputs[5]
    if len(signs[0]) and not (signs == signs[0]).all():
        return None
    if coupled:
        doubtful = np.full(len(nodes), several)
        forces, found = statics.settled(inputs, doubtful, critical=False)
        settled = forces.good | [k in found and len(found[k].sizes) == 1 for k in range(len(nodes))]
        if not settled.all():
            return None
        loaded = forces.whole
    else:
        loaded = statics.loaded(inputs, statics.sizes(inputs)[0], friction=False)
    driven, loads, _, energy, _ = loaded.powers.T
    lost = loaded.losses.sum(axis=1) if coupled else 0.0 * driven
    step = half / moving.speed
    series = LEGENDRE @ np.stack([driven, loads, lost], axis=1)[1:-1]
    if np.abs(series[-2:]).max() > RESOLVED * np.abs(series).max():
        return None

    def integral(values: Any) -> float:
        return float(step * (WEIGHTS @ values[1:-1]))

    gained = float(energy[-1] - energy[0])
    size = abs(integral(np.abs(driven) + np.abs(loads) + lost))
    size += abs(gained) + 1e-3 * float(np.abs(energy).max())
    return abs(integral(driven + loads - lost) - gained) / size if size else 0.0
