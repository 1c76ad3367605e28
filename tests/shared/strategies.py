"""What hypothesis draws: numbers, scales, orders and mechanisms with their mirror images."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

import mechdae as md
from tests.shared.mechanisms import four_bar

bounded = settings(
    max_examples=12,
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
"""The same few examples in each run: for tests whose examples solve something."""
scales = st.floats(-6.0, 3.0).map(lambda power: 10.0**power)
"""Micrometres to kilometres."""
NAMES = st.from_regex(r"[A-Za-z][A-Za-z0-9_]{0,8}", fullmatch=True)
"""Names of bodies and points."""
numbers = st.floats(-1e6, 1e6, allow_subnormal=False)
angles = st.floats(-3.1, 3.1)


def orders(names: str) -> st.SearchStrategy[tuple[str, ...]]:
    """Draw the order of names with blanks between them."""
    return st.sampled_from(list(permutations(names.split())))


@st.composite
def crank_rockers(draw: st.DrawFn, scale: float = 1.0) -> md.Mechanism:
    """Draw a four-bar whose crank turns round: Grashof's a + longest < sum of the other two."""
    b, c, d = (draw(st.floats(1.0, 1.9)) for _ in range(3))
    most = min(b, c, d, b + c + d - 2 * max(b, c, d))
    a = draw(st.floats(0.2, 0.9)) * most
    sign = draw(st.sampled_from([1, -1]))
    return four_bar(*(scale * x for x in (a, b, c, d)), crank=0.5, rocker=1.6 * sign)


def scaled(mechanism: md.Mechanism, factor: float) -> md.Mechanism:
    """Return a mechanism of pins with all lengths by a factor, x and y by one each."""
    return stretched(mechanism, factor, factor)


def mirrored(mechanism: md.Mechanism) -> md.Mechanism:
    """Return the image of a mechanism of pins in the line y = 0."""
    image = stretched(mechanism, 1.0, -1.0)
    return replace(image, sketch={name: -angle for name, angle in mechanism.sketch.items()})


def stretched(mechanism: md.Mechanism, x: float, y: float) -> md.Mechanism:
    """Return a mechanism with the coordinates of all points by factors."""

    def points(body: md.Body | md.Ground) -> dict[str, tuple[float, float]]:
        return {name: (x * px, y * py) for name, (px, py) in body.points.items()}

    bodies = {name: replace(own, points=points(own)) for name, own in mechanism.bodies.items()}
    ground = replace(mechanism.ground, points=points(mechanism.ground))
    return replace(mechanism, ground=ground, bodies=bodies)


def ordered(mechanism: md.Mechanism, bodies: tuple[str, ...]) -> md.Mechanism:
    """Return a mechanism whose bodies are declared in an order, and its joints backwards."""
    return replace(
        mechanism,
        bodies={name: mechanism.bodies[name] for name in bodies},
        joints=dict(reversed(list(mechanism.joints.items()))),
    )


def turned_round(mechanism: md.Mechanism) -> md.Mechanism:
    """Return a mechanism whose joints have their two bodies the other way round."""
    joints = {
        name: replace(joint, first=joint.second, second=joint.first)
        for name, joint in mechanism.joints.items()
    }
    return replace(mechanism, joints=joints)


@st.composite
def mechanisms(draw: st.DrawFn) -> md.Mechanism:
    """Draw bodies with any names and numbers in a row, each on the one before by some joint."""
    names = draw(st.lists(NAMES.filter(lambda name: name != "ground"), min_size=1, max_size=3))
    names = [f"{name}{k}" for k, name in enumerate(names)]
    bodies = [
        md.Body(
            name,
            {"P": (draw(numbers), draw(numbers)), "Q": (draw(numbers), draw(numbers))},
            mass=draw(st.none() | st.floats(0.0, 1e3)),
        )
        for name in names
    ]
    joints: list[md.Revolute | md.Prismatic | md.PinInSlot | md.Distance] = []
    for k, (before, name) in enumerate(zip(["ground", *names], names, strict=False)):
        ends = (f"j{k}_", f"{before}.Q", f"{name}.P")  # names of bodies end in a digit
        joints.append(
            draw(
                st.one_of(
                    st.just(md.Revolute(*ends)),
                    st.builds(md.Revolute, *map(st.just, ends), pin_radius=st.floats(0.0, 1.0)),
                    st.builds(md.Prismatic, *map(st.just, ends), axis=angles, turn=angles),
                    st.builds(md.PinInSlot, *map(st.just, ends), axis=angles),
                    st.builds(md.Distance, *map(st.just, ends), length=st.floats(1e-6, 1e6)),
                )
            )
        )
    sketch = {name: draw(angles) for name in names}
    ground = md.Ground({"Q": (draw(numbers), draw(numbers))})
    return md.Mechanism(ground=ground, bodies=bodies, joints=joints, sketch=sketch)
