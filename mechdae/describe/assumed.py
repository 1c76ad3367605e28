"""What is assumed where a file is silent and the answer depends on it, as sentences for results."""

from __future__ import annotations

from collections.abc import Iterable

from mechdae.describe.coordinates import coordinate
from mechdae.describe.loads import Spring
from mechdae.describe.mechanism import GROUND, TOLERANCE, Mechanism
from mechdae.describe.tasks.kinds import Driven
from mechdae.describe.tasks.motion import Reactions


def usual_speed(mechanism: Mechanism, task: Driven) -> str:
    """Return at what speed drivers move that have none, with the unit; "" without such drivers."""
    units = [coordinate(mechanism, driver.coordinate).unit for driver in task.untimed]
    return " and ".join(f"1 {unit}/s" for unit in dict.fromkeys(units))


def about_speeds(mechanism: Mechanism, task: Driven) -> list[str]:
    """Return what the rates of a task are those of, where its drivers have no speed."""
    if not task.untimed:
        return []
    names, pace = [driver.coordinate for driver in task.untimed], usual_speed(mechanism, task)
    have, rates = "have" if names[1:] else "has", "velocities and accelerations"
    slow = isinstance(task, Reactions) and task.quasi_static
    rates = "velocities, losses and powers" if slow else rates
    return [f"{', '.join(names)} {have} no speed: {rates} are those at {pace}"]


def about_closure(mechanism: Mechanism) -> list[str]:
    """Return how far redundant equations of a task may stay open."""
    if not mechanism.tolerance:
        return []
    return [f"redundant equations close within {mechanism.tolerance:g} m ({TOLERANCE})"]


def about_inertia(mechanism: Mechanism, task: Reactions) -> list[str]:
    """Return that a task of forces is quasi-static, where its drivers have no speed."""
    if not task.quasi_static:
        return []
    senses: dict[str, list[str]] = {}
    for driver in task.untimed:
        senses.setdefault(driver.direction or "positive", []).append(driver.coordinate)
    ways = " and ".join(
        f"in the {way} sense of {', '.join(names)}" for way, names in senses.items()
    )
    text = "quasi-static: forces of inertia and damping are zero"
    return [f"{text}, friction and resistances oppose a slow motion {ways}"]


def about_bodies(mechanism: Mechanism, names: Iterable[str], moves: bool = True) -> list[str]:
    """Return what is assumed about masses of bodies; inertia counts where they `moves`."""
    bodies = [mechanism.bodies[name] for name in names]
    heavy = [body for body in bodies if body.mass is not None]
    found = {
        "massless": [body for body in bodies if body.mass is body.inertia is None],
        "point masses (no inertia given)": [
            body for body in heavy if moves and body.inertia is None
        ],
        "mass at the origin (no center given)": [body for body in heavy if body.center is None],
        "without weight (no gravity given)": heavy if mechanism.gravity is None else [],
    }
    return [
        f"{text}: {', '.join(b.name for b in bodies)}" for text, bodies in found.items() if bodies
    ]


def about_springs(mechanism: Mechanism) -> list[str]:
    """Return springs whose free length nobody gave."""
    springs = [load for load in mechanism.loads.values() if isinstance(load, Spring)]
    short = [
        spring.name for spring in springs if spring.stiffness != 0.0 and spring.free_length == 0.0
    ]
    return [f"free length 0: {', '.join(short)}"] if short else []


def about_blocks(mechanism: Mechanism, names: Iterable[str]) -> list[str]:
    """Return of which guides that rub over a length the block is fixed: the second body."""
    values = mechanism.values()
    fixed = {
        name: mechanism.joints[name].second
        for name in dict.fromkeys(names)
        if f"{name}.contact_length" in values and mechanism.joints[name].second_body == GROUND
    }
    return [
        f"{name} rubs over {values[f'{name}.contact_length']:g} m about {point}: its block is fixed"
        for name, point in fixed.items()
    ]


def about_motion(mechanism: Mechanism, rubbing: Iterable[str] = ()) -> list[str]:
    """Return what is assumed in a motion or an equilibrium, with friction in some joints."""
    found = about_bodies(mechanism, mechanism.bodies) + about_springs(mechanism)
    rubbing = list(rubbing)
    found += about_blocks(mechanism, rubbing) + about_closure(mechanism)
    joints = [mechanism.joints[name] for name in dict.fromkeys(rubbing) if name in mechanism.joints]
    same = [joint.name for joint in joints if getattr(joint, "friction_static", 0.0) is None]
    if same:
        found.append(f"friction at rest as in motion (no friction_static): {', '.join(same)}")
    return found
