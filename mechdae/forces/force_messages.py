"""What is wrong with forces, in sentences; virtual power, energy, balance of bodies as checks.

The power balance of one pose is an identity of the equations that were solved: it finds a
force that does work where it should not, and nothing that is wrong in the accelerations. The
kinetic energy differenced along the path does: it uses speeds only.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping

import numpy as np

from mechdae.describe.assumed import about_blocks, about_bodies, about_inertia, about_springs
from mechdae.describe.tasks.motion import Reactions
from mechdae.describe.units import shown
from mechdae.forces.friction_branches import FrictionSolutions
from mechdae.forces.inverse_dynamics import InverseDynamics
from mechdae.forces.poses import Moving, PoseForces, solved
from mechdae.motion.continuation.follower import extend
from mechdae.motion.continuation.path import Path
from mechdae.motion.kinematics.prepared import Setting
from mechdae.types import Booleans, Floats, Integers

TOLERANCE = 1e-9
"""Share by which a check may fail before the result says so."""


def lost_poses(setting: Setting, answer: PoseForces, places: Integers) -> list[str]:
    """Return a sentence on poses that assemble and have no finite forces."""
    if not places.size:
        return []
    c = setting.plan.coordinates[setting.plan.lead]
    first = shown(c.unit, float(answer.motion.u[places[0], setting.plan.lead]))
    return [
        f"{places.size} of {len(answer.motion)} poses have no finite forces, first at "
        f"{c.text} = {first}: "
        f"the constraints lose their rank there (a change point)"
    ]


def verdicts(setting: Setting, answer: PoseForces) -> list[str]:
    """Return what is wrong in sentences: jammed and ambiguous poses."""
    c = setting.plan.coordinates[setting.plan.lead]
    at = answer.motion.u[:, setting.plan.lead]

    def place(k: int) -> str:
        return f"{c.text} = {shown(c.unit, float(at[k]))}"

    jammed, ambiguous = np.flatnonzero(answer.jammed), np.flatnonzero(answer.ambiguous)
    return about_friction(len(at), jammed, ambiguous, answer.found, place)


def about_friction(
    n: int, jammed: Integers, ambiguous: Integers, found: Mapping[int, FrictionSolutions],
    place: Callable[[int], str],
) -> list[str]:  # fmt: skip
    """Return sentences on poses of `n` that jam or have several solutions, given by number.

    `found` are the solutions of each, `place` says where a pose is.
    """
    faults = []
    if len(jammed):
        solutions = found[int(jammed[0])]
        text = f"{len(jammed)} of {n} poses are jammed: no equilibrium with friction, first at "
        text += place(int(jammed[0]))
        if solutions.critical is not None:
            text += f", where it jams from {solutions.critical:.6g} times the friction given on"
            text += f", by joint {solutions.joint}" if solutions.joint else ""
        faults.append(text)
    if len(ambiguous):
        known = all(found[int(k)].connected is not None for k in ambiguous)
        which = "the one that continues from no friction" if known else "one of them"
        faults.append(
            f"{len(ambiguous)} of {n} poses have several solutions, first at "
            f"{place(int(ambiguous[0]))}; {which} is given, all are listed"
        )
    return faults


def slack(statics: InverseDynamics, answer: PoseForces) -> list[str]:
    """Return belts whose slack strand would have to push."""

    def moment(name: str) -> Floats:
        return answer.whole.reactions[:, statics.balance.joints.index(name), 2]

    def when(slack: Booleans) -> str:
        return f" at {int(slack.sum())} of {len(slack)} poses"

    scene = statics.scene
    found: list[str] = []
    for case in scene.cases("forces of joints"):
        found += case.slack_belts(scene.model, statics.meshes, moment, when)
    return found


def failed_checks(found: Mapping[str, float]) -> list[str]:
    return [
        f"check '{name}' fails: {value:.3g} of the forces and powers in it"
        for name, value in found.items()
        if value is not None and not value <= TOLERANCE
    ]


def assumptions_of(statics: InverseDynamics, task: Reactions) -> list[str]:
    mechanism = statics.scene.model.mechanism
    balance = statics.balance
    found = about_inertia(mechanism, task)
    found += about_bodies(mechanism, balance.bodies, moves=not task.quasi_static)
    found += about_springs(mechanism)
    if task.friction != "none":
        lossy = balance.lossy
        found += about_blocks(mechanism, lossy)
        smooth = [
            name for name in balance.joints if name not in lossy and mechanism.joints[name].rubs
        ]
        if lossy and smooth:
            found.append(f"without friction: {', '.join(smooth)}")
    return found


CHECKS = ("virtual_power", "energy", "balance")
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


def checks(statics: InverseDynamics, moving: Moving, answer: PoseForces) -> dict[str, float | None]:
    """Return the largest relative errors of the three checks.

    ``energy`` is None where there is no path to difference along. A number that is not finite
    where there should be forces makes a check not finite.
    """
    left = statics.imbalance(answer.inputs, answer.sizes, answer.whole, answer.coupled)
    balance = _largest(left, answer.standing)
    found = (_power(statics, answer), _energy(statics, moving, answer), balance)
    return dict(zip(CHECKS, found, strict=True))


def _largest(values: Floats, rows: Booleans) -> float:
    return float(np.max(np.abs(values), initial=0.0, where=rows))


def powers_of(statics: InverseDynamics, answer: PoseForces) -> tuple[Floats, ...]:
    """Return powers of drivers, loads and joints, rate of the kinetic energy, it itself, sizes."""
    loads, rate, energy, sizes = statics.powers(answer.inputs)
    whole, motion = answer.whole, answer.motion
    lost = -whole.losses.sum(axis=1) if answer.coupled else 0.0 * loads
    single = np.einsum("nk,nk->n", np.abs(whole.efforts), np.abs(motion.speeds))
    return whole.driven(motion), loads, lost, rate, energy, sizes + single - lost


def _power(statics: InverseDynamics, answer: PoseForces) -> float:
    """Return the error of drivers + loads - losses = rate of the kinetic energy."""
    driven, loads, lost, rate, _, sizes = powers_of(statics, answer)
    size = _largest(sizes, answer.standing)
    return _largest(driven + loads + lost - rate, answer.standing) / size if size else 0.0


def _energy(statics: InverseDynamics, moving: Moving, answer: PoseForces) -> float | None:
    """Return the largest error of the energy over some panels, those of one width at once."""
    if not moving.speed:
        return None
    rows = np.flatnonzero(answer.standing & ~answer.ambiguous)
    if not rows.size:
        return None
    condition = moving.run.poses.condition[rows]
    rows = rows[condition <= max(WELL, 2 * float(np.median(condition)))]
    chosen = rows[np.linspace(0, len(rows) - 1, min(PANELS, len(rows))).astype(int)]
    plan = moving.setting.plan
    angular = moving.by_value and plan.coordinates[plan.lead].is_angle
    unit = 1.0 if angular else moving.run.path.largest * 20
    places = np.asarray(moving.run.places, float)[chosen]
    errors: list[float] = []
    for centres, several in ((places, False), (places[:1], True)):
        if several and (errors or not answer.coupled):
            break
        for half, side in itertools.product(WIDTHS, (0.0, 1.0, -1.0)):
            middles = centres + 1.01 * side * half * unit
            found, good = _panels(statics, moving, middles, half * unit, several)
            errors += found[good].tolist()
            centres = centres[~good]
            if not centres.size:
                break
    return float(np.max(errors)) if errors else None


def _panels(
    statics: InverseDynamics, moving: Moving, middles: Floats, half: float, several: bool
) -> tuple[Floats, Booleans]:
    """Return the relative errors of the energy over panels, and which of them are good.

    Others hold a kink or an end of the motion, or are too wide. Places that may have `several`
    solutions are looked at only if asked, one by one they take long.
    """
    path = moving.run.path
    if path.graphs.nx and isinstance(path, Path):
        for middle in middles:
            extend(path, middle + half)
            extend(path, middle - half)
    share = np.concatenate([[-1.0], NODES, [1.0]])
    motion, count = moving.at((middles[:, None] + half * share).ravel()), len(share)
    forces = solved(statics, motion, motion.there & several, critical=False)
    good = motion.there & (forces.good | [k in forces.found for k in range(len(motion))])
    whole = np.all((good & (forces.counts == 1)).reshape(-1, count), axis=1)
    signs = forces.inputs[5].reshape(len(middles), count, -1)
    whole &= (signs == signs[:, :1]).all(axis=(1, 2))
    *powers, _, energy, _ = powers_of(statics, forces)
    values = np.stack(powers, axis=1).reshape(len(middles), count, 3)
    energy = energy.reshape(len(middles), -1)
    with np.errstate(invalid="ignore"):
        series = np.abs(LEGENDRE @ values[:, 1:-1])
        whole &= ~(series[:, -2:].max(axis=(1, 2)) > RESOLVED * series.max(axis=(1, 2)))
    means = half / moving.speed * np.einsum("k,mkp->mp", WEIGHTS, values[:, 1:-1])
    gross = half / moving.speed * np.einsum("k,mkp->m", WEIGHTS, np.abs(values[:, 1:-1]))
    gained = energy[:, -1] - energy[:, 0]
    size = np.abs(gross) + np.abs(gained) + 1e-3 * np.abs(energy).max(axis=1)
    error = np.abs(means.sum(axis=1) - gained)
    return np.divide(error, size, out=np.zeros(len(size)), where=size != 0), whole
