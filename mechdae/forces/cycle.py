"""Mean powers, losses and efficiency over a cycle, and the arcs that jam or lock themselves.

Powers have kinks: where a sliding speed or a normal force changes its sign, where a table
changes its piece. They are located on the path, and the integrals are taken between them, by
adaptive quadrature, never on the grid of the poses.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from mechdae.describe.units import shown
from mechdae.errors import InputError
from mechdae.forces.formula_changes import ROUNDING, State, fastest, kinks_of
from mechdae.forces.inverse_dynamics import InverseDynamics
from mechdae.forces.poses import Moving, PoseForces
from mechdae.motion.continuation.legs import Legs
from mechdae.numerics.quadrature import NOISE, Substitution, integrate
from mechdae.types import Floats, Json

NO_POWER = 1e-9
"""Share of the losses below which the power without friction is none: idling, all is lost."""
DRIVER = 2
"""Powers of the driver, without friction and with it, before the losses of the joints."""
EPSILON = 16 * float(np.finfo(float).eps)
"""Rounding of a mean, as a share of the largest power."""
ROUNDED = EPSILON / NOISE
"""Share of force by speed whose noise, as the quadrature knows it, is rounding of the power."""
SMALL = 1e-6
"""Share of the largest power below which a joint's loss does not count for the error."""
KNOWN = 1e-6
"""Error of the integrals, relative, above which the result says so."""
STEPS = (1e-5, 1e-7)
"""Shares of the way at which losses beside a change point are compared."""
GROWS = 30.0


def cycle(statics: InverseDynamics, moving: Moving, answer: PoseForces) -> tuple[Json, list[str]]:
    """Return the figures of a cycle and sentences on what is wrong with it.

    Raises
    ------
    InputError
        The task has no path to integrate along.
    """
    low, high = interval(moving)
    ends, poses = [0, -1], moving.run.poses
    if not (answer.there[ends] & (poses.places[ends] == poses.s[ends])).all():
        text = "the mean powers of the cycle have no value: the motion does not go all the way"
        return {}, [text]
    state = State(statics, moving)
    c = moving.setting.plan.coordinates[moving.setting.plan.lead]
    word, unit = (c.text, c.unit) if moving.by_value else ("t [s]", "1")
    unbounded = _unbounded(state, low, high)
    if unbounded is not None:
        text = "the cycle has no mean powers: losses grow beyond all bounds at the change point "
        return {}, [f"{text}{word} = {shown(unit, unbounded)}"]
    coupled = answer.coupled
    kinks, arcs, known = kinks_of(state, answer)
    figures: dict[str, object] = {
        "jammed_arcs": arcs["jammed"], "self_locking_arcs": arcs["locking"], "kinks": kinks
    }  # fmt: skip
    if arcs["ambiguous"]:
        figures["ambiguous_arcs"] = arcs["ambiguous"]
    faults = _about_arcs(arcs, word, unit)
    panels = [low, *[k for k in kinks if low < k < high], high]
    charts = [Substitution(a, b) for a, b in itertools.pairwise(panels) if b > a]
    jammed = bool(arcs["jammed"])

    def powers(s: Floats) -> Floats:
        whole = coupled and not jammed
        return state.powers(state.at(s, whole), whole)

    way = high - low
    flow = np.nan_to_num(np.abs(known[coupled and not jammed])).mean(axis=0) * way
    gross = float(flow.max(initial=0.0))
    forces = answer.whole.reactions[..., : len(statics.scene.model.space.axes)]
    most = float(np.nan_to_num(np.abs(forces)).max(initial=0.0))  # also where none has any power
    rounded = max(gross, ROUNDED * most * fastest(statics, answer.motion) * way)

    def sizes(
        found: Floats,
    ) -> Any:  # the mean power of masses alone is zero, that in and out is not
        return np.maximum(np.abs(found), np.where(np.arange(len(found)) < DRIVER, flow, 0.0))

    total, error = integrate(powers, charts, sizes, lambda found: np.full(len(found), rounded))
    total[np.abs(total) <= ROUNDING * gross] = 0.0
    off = (error + EPSILON * gross) / way
    figures |= _figures(statics.balance.lossy, total / way, off, coupled, jammed)
    least = max(SMALL * gross, NO_POWER * rounded)
    share = error / np.maximum(sizes(total), least) if gross else np.zeros(len(error))
    figures["quadrature_error"] = off = float(share.max(initial=0.0))
    if not np.isfinite(total).all():
        faults.append(
            "the mean powers of the cycle have no value: a force is not finite between the poses"
        )
    elif off > KNOWN:
        faults.append(
            f"the mean powers of the cycle are known to {off:.1g} of them only: forces grow too "
            f"steeply between the poses"
        )
    return figures, faults


def interval(moving: Moving) -> tuple[float, float]:
    """Return the ends of the way over which powers are integrated."""
    places = moving.run.places
    low, high = float(np.min(places)), float(np.max(places))
    if isinstance(moving.run.path, Legs) or low == high:
        raise InputError("a cycle needs one driver that moves over an interval", where="cycle")
    steps = np.sign(np.diff(places))
    if steps.min() < 0 < steps.max():
        word = "driver.at" if moving.by_value else "driver.times"
        raise InputError("the poses of a cycle go one way", where=word)
    if moving.by_value and not moving.speed:
        raise InputError("a cycle needs a driver that moves, its speed is 0", where="driver.speed")
    if moving.by_value and moving.setting.plan.acceleration.any():
        raise InputError("a cycle needs a driver of constant speed", where="driver.acceleration")
    return low, high


def _about_arcs(arcs: dict[str, list[list[float]]], word: str, unit: str) -> list[str]:
    """Return what is wrong with a cycle over arcs that jam or have several solutions."""

    def spans(name: str) -> str:
        return ", ".join(" to ".join(shown(unit, end) for end in arc) for arc in arcs[name])

    faults = []
    if arcs["jammed"]:
        faults.append(f"the cycle has no mean powers: jammed for {word} from {spans('jammed')}")
    if arcs["ambiguous"]:
        text = f"several solutions for {word} from {spans('ambiguous')}"
        if not arcs["jammed"]:
            text += ": mean powers are those of the one that continues the motion without friction"
        faults.append(text)
    return faults


def _unbounded(state: State, low: float, high: float) -> float | None:
    """Return the first change point inside at which losses grow like 1/distance, if any."""
    moving = state.moving
    key = "at" if moving.by_value else "time"
    for event in moving.run.events:
        place = event.get(key)
        if event["kind"] != "change_point" or place is None or not low < place < high:
            continue
        near = [place + side * share * (high - low) for share in STEPS for side in (1, -1)]
        losses = state.at(np.array(near), coupled=False).free.losses.sum(axis=1)
        if (losses[2:] > GROWS * losses[:2]).any():
            return float(place)
    return None


def _figures(names: list[str], mean: Floats, error: Floats, coupled: bool, jammed: bool) -> Json:
    """Return the figures of a cycle from mean powers and their errors, of driver and joints."""

    def split(powers: Floats) -> tuple[float, float, Floats, Floats]:
        """Return what belongs to the driver and to the joints, without friction and with it."""
        joints = powers[DRIVER:].reshape(2, -1)
        return float(powers[0]), float(powers[1 if coupled else 0]), *joints[[0, int(coupled)]]

    def listed(powers: Floats) -> dict[str, float]:
        return dict(zip(names, powers.tolist(), strict=True))

    free, whole, lost_free, lost = split(mean)
    inner, outer, off_free, off = split(error)
    figures: Json = {}
    estimate, loss = float(lost_free.sum()), float(lost.sum())
    if abs(free) <= NO_POWER * estimate:
        free = 0.0
    drives, power = free >= 0, abs(free)
    if names and power:
        figures["efficiency_formula_10"] = (power - estimate) / power
        ratio = power / (power + estimate) if drives else (power - estimate) / power
        figures["efficiency_uncoupled"] = ratio
    if names:
        figures["loss_uncoupled"] = estimate
        figures["loss_by_joint_uncoupled"] = listed(lost_free)
    if jammed:
        return figures
    useful, entered = (power, whole) if drives else (-whole, power)
    if not coupled:
        useful = entered = power
    figures |= {"useful": useful, "loss": loss, "input": entered}
    figures["mean_errors"] = {
        "useful": inner if drives else outer,
        "input": outer if drives else inner,
        "loss": float(off.sum()),
        "loss_by_joint": listed(off),
        "loss_by_joint_uncoupled": listed(off_free),
    }
    if coupled or names:
        figures["loss_by_joint"] = listed(lost)
    if not coupled and names and power:
        figures["efficiency"] = figures["efficiency_formula_10"]
    elif coupled and (not drives or whole > 0):
        figures["efficiency"] = useful / entered
    return figures
