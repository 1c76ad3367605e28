"""The checks that come with forces: virtual power, energy along the path, balance of bodies.

The power balance of one pose is an identity of the equations that were solved: it finds a
force that does work where it should not, and nothing that is wrong in the accelerations. The
kinetic energy differenced along the path does: it uses speeds only.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdae.analysis.legs import Legs
from mechdae.analysis.moving import Moving
from mechdae.analysis.statics import Loaded, Statics

PANELS = 6
WIDTH = 0.02
"""Half width of a panel [rad, or in the unit of the path's parameter]."""
NODES, WEIGHTS = np.polynomial.legendre.leggauss(10)


def checks(statics: Statics, moving: Moving, answer: Any) -> dict[str, Any]:
    """Return the largest relative errors of the three checks.

    ``energy`` is None where there is no path to difference along.
    """
    coupled = answer.whole is not answer.free
    return {
        "virtual_power": _power(answer.whole, coupled),
        "energy": _energy(statics, moving, answer, coupled),
        "balance": _largest(answer.whole.imbalance),
    }


def _largest(values: Any) -> float:
    return float(np.fmax.reduce(np.abs(values), axis=None, initial=0.0))


def _power(loaded: Loaded, coupled: bool) -> float:
    """Return the error of drivers + loads - losses = rate of the kinetic energy."""
    driven, loads, rate = loaded.powers[:, :3].T
    lost = loaded.losses.sum(axis=1) if coupled else 0.0 * driven
    size = _largest(np.abs(driven) + np.abs(loads) + np.abs(rate) + lost)
    return _largest(driven + loads - lost - rate) / size if size else 0.0


def _energy(statics: Statics, moving: Moving, answer: Any, coupled: bool) -> float | None:
    extend = bool(moving.run.path.graphs.nx)
    if not moving.speed:
        return None
    places = moving.run.places[answer.there]
    if not len(places):
        return None
    chosen = places[np.linspace(0, len(places) - 1, min(PANELS, len(places))).astype(int)]
    plan = moving.setting.plan
    angular = moving.by_value and plan.coordinates[plan.lead].is_angle
    unit = 1.0 if angular else moving.run.path.largest * 20
    worst = None
    for centre in chosen:
        for side in (0.0, 1.0, -1.0):
            found = _panel(statics, moving, float(centre), WIDTH * unit, side, coupled, extend)
            if found is not None:
                worst = max(found, worst or 0.0)
                break
    return worst


def _panel(
    statics: Statics,
    moving: Moving,
    centre: float,
    half: float,
    side: float,
    coupled: bool,
    extend: bool,
) -> float | None:
    """Return the relative error of the energy over one panel, None where it has a kink."""
    middle = centre + 1.01 * side * half
    path = moving.run.path
    if extend and not isinstance(path, Legs):
        path.extend(middle + half)
        path.extend(middle - half)
    nodes = np.concatenate([[middle - half], middle + half * NODES, [middle + half]])
    motion = moving.at(nodes)
    if not np.isfinite(motion.a).all():
        return None
    inputs = statics.inputs(motion)
    signs = inputs[5]
    if len(signs[0]) and not (signs == signs[0]).all():
        return None
    if coupled:
        forces = statics.forces(inputs)
        if not forces.good.all():
            return None
        loaded = forces.whole
    else:
        loaded = statics.loaded(inputs, statics.sizes(inputs)[0], friction=False)
    driven, loads, _, energy = loaded.powers.T
    lost = loaded.losses.sum(axis=1) if coupled else 0.0 * driven
    step = half / moving.speed

    def integral(values: Any) -> float:
        return float(step * (WEIGHTS @ values[1:-1]))

    gained = float(energy[-1] - energy[0])
    size = abs(integral(np.abs(driven) + np.abs(loads) + lost))
    size += abs(gained) + 1e-3 * float(np.abs(energy).max())
    return abs(integral(driven + loads - lost) - gained) / size if size else 0.0
