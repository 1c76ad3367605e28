"""Screw axes, axodes and transmission angles in space, against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mechdae as md

TURN = 2 * np.pi
O3 = {"O": (0, 0, 0)}


def swept(mechanism: md.Mechanism, driver: str, *names: str, poses: int = 7, **keys: float):
    keys = {"from_": 0.3, "to": 5.9} | keys
    sweep = md.Sweep(driver=md.Driver(driver, **keys), poses=poses, measures=names)
    result = md.solve(mechanism, sweep)
    assert set(result.status) == {"ok"}
    return result


def distance_of_lines(p, u, q, v):
    """Shortest distance of lines p + s u and q + t v that are not parallel."""
    across = np.cross(u, v)
    return np.abs(np.sum((p - q) * across, axis=-1)) / np.linalg.norm(across, axis=-1)


@pytest.mark.parametrize("pitch", [0.12, -0.02])
def test_a_nut_turns_about_its_thread(pitch: float) -> None:
    """The axis is that of the joint; the pitch is the joint's, in metres a turn."""
    axis, at = np.array([1, 2, 2]) / 3, np.array([0.1, -0.2, 0.05])
    nut = md.Mechanism(
        dimension=3,
        ground=md.Ground({"O": tuple(at)}),
        bodies=[md.Body("nut", {"O": (0.02, 0, 0)})],
        joints=[md.Screw("H", "ground.O", "nut.O", axis=(1, 2, 2), pitch=pitch)],
    )
    own = swept(nut, "H.angle", "axodes").bodies["nut"]
    np.testing.assert_allclose(own.screw_pitch, pitch, rtol=1e-14)
    np.testing.assert_allclose(own.axode_fixed_direction, np.tile(axis, (7, 1)), atol=1e-14)
    foot = at - axis * (axis @ at)
    np.testing.assert_allclose(own.axode_fixed_point, np.tile(foot, (7, 1)), atol=1e-15)
    local = np.array([0.02, 0, 0])
    np.testing.assert_allclose(
        own.axode_moving_point, np.tile(local - axis * (axis @ local), (7, 1)), atol=1e-15
    )


def test_turning_and_sliding_at_once_is_a_screw() -> None:
    """A cylindrical pair with both coordinates driven: the pitch is 2 pi times their ratio."""
    mechanism = md.Mechanism(
        dimension=3,
        ground=md.Ground(O3),
        bodies=[md.Body("bolt", O3)],
        joints=[md.Cylindrical("C", "ground.O", "bolt.O", axis=(0, 1, 0))],
    )
    drivers = [
        md.Driver("C.angle", at=[0.0, 1.0], speed=-4.0),
        md.Driver("C.slide", at=[0.0, 0.1], speed=0.6),
    ]
    result = md.solve(mechanism, md.Sweep(drivers=drivers, measures=["axodes"]))
    own = result.bodies["bolt"]
    np.testing.assert_allclose(own.screw_pitch, -TURN * 0.6 / 4, rtol=1e-14)
    np.testing.assert_allclose(own.axode_fixed_direction, [[0, -1, 0]] * 2, atol=1e-15)


def planet(ratio: float, angle: float, apart: float = 0.0) -> md.Mechanism:
    """A wheel that rolls on a fixed one; its axis is turned by `angle` and `apart` along x."""
    axis, place = (0.0, np.sin(angle), np.cos(angle)), (apart, 0.0, 0.0)
    return md.Mechanism(
        dimension=3,
        ground=md.Ground(O3),
        bodies=[
            md.Body("cage", O3 | {"P": place}),
            md.Body("planet", {"P": (0, 0, 0), "T": (0, 0.02, 0)}),
            md.Body("sun", O3),
        ],
        joints=[
            md.SpatialRevolute("cage_pin", "ground.O", "cage.O", axis=(0, 0, 1)),
            md.SpatialWeld("fixed", "ground.O", "sun.O", axis=(0, 0, 1)),
            md.SpatialRevolute("sun_pin", "cage.O", "sun.O", axis=(0, 0, 1)),
            md.SpatialRevolute("planet_pin", "cage.P", "planet.P", axis=axis),
            md.SpatialGear("mesh", "sun.O", "planet.P", carrier="cage", ratio=ratio),
        ],
        sketch={"cage_pin.angle": 0.0},
    )


@pytest.mark.parametrize("angle", [np.pi / 2, 1.1, 2.0])
def test_axodes_of_bevel_gears_are_their_pitch_cones(angle: float) -> None:
    """tan d1 = sin S / (n + cos S), n = z2 / z1 (Litvin); both cones have the apex on both axes."""
    n = 16 / 24
    result = swept(planet(-n, angle), "cage_pin.angle", "axodes", poses=13)
    own, axis = result.bodies["planet"], np.array([0, np.sin(angle), np.cos(angle)])
    assert np.abs(own.screw_pitch).max() < 1e-16
    assert np.abs(own.axode_fixed_point).max() < 1e-16
    pitch1 = np.arctan2(np.sin(angle), n + np.cos(angle))
    pitch2 = np.arctan2(np.sin(angle), 1 / n + np.cos(angle))
    assert pitch1 + pitch2 == pytest.approx(angle, abs=1e-15)
    for seen, about, half in (
        (own.axode_fixed_direction, (0, 0, 1), pitch1),
        (own.axode_moving_direction, axis, pitch2),
    ):
        cosine = np.abs(seen @ np.array(about))
        np.testing.assert_allclose(cosine, abs(np.cos(half)), atol=1e-15)


@pytest.mark.parametrize("ratio", [-2 / 3, 0.5])
def test_axodes_of_skew_gears_are_hyperboloids(ratio: float) -> None:
    """Axes at the distance a, the second turned by S about the way to it, speeds 1 and w.

    The screw axis lies at a w (w - cos S) / q from the first and has the pitch 2 pi a w sin S / q,
    q = 1 + w^2 - 2 w cos S (Plücker's conoid).
    """
    angle, apart = 1.2, 0.08
    result = swept(planet(ratio, angle, apart), "cage_pin.angle", "axodes", "screw-axes", poses=13)
    w = 1 / ratio  # sun - cage = ratio (planet - cage), seen from the cage
    q = 1 + w**2 - 2 * w * np.cos(angle)
    from_first = apart * w * (w - np.cos(angle)) / q
    own = result.bodies["planet"]
    np.testing.assert_allclose(own.screw_pitch, -TURN * apart * w * np.sin(angle) / q, rtol=1e-13)
    p, u, z = own.axode_fixed_point, own.axode_fixed_direction, np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(distance_of_lines(p, u, 0 * p, z), abs(from_first), rtol=1e-12)
    np.testing.assert_allclose(np.abs(u[:, 2]), abs(w * np.cos(angle) - 1) / np.sqrt(q), rtol=1e-13)
    p, u = own.axode_moving_point, own.axode_moving_direction
    axis = np.array([0, np.sin(angle), np.cos(angle)])
    off = abs(apart - from_first)
    np.testing.assert_allclose(distance_of_lines(p, u, 0 * p, axis), off, rtol=1e-12)
    np.testing.assert_allclose(np.abs(u @ axis), abs(w - np.cos(angle)) / np.sqrt(q), rtol=1e-13)
    pair = {key: result.centres[f"planet-sun.{key}"] for key in ("direction", "point", "pitch")}
    np.testing.assert_allclose(pair["pitch"], own.screw_pitch, rtol=1e-14)  # the sun stands still
    np.testing.assert_allclose(pair["direction"], -own.axode_fixed_direction, atol=1e-15)


def test_shafts_of_a_cardan_joint_turn_about_an_axis_through_its_centre() -> None:
    """Its direction: out' e - in' i with tan out = tan in cos S, S the angle of the shafts."""
    problem = md.load("cardan-joint")
    task = replace(problem.tasks["poses"], measures=("screw-axes",))
    found = md.solve(problem, task)
    u = found.drivers["I.angle"].position
    cosine = 4 / 5
    speed = cosine / (np.cos(u) ** 2 + cosine**2 * np.sin(u) ** 2)
    way = speed[:, None] * np.array([0.8, 0, 0.6]) - np.array([1.0, 0, 0])
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    np.testing.assert_allclose(found.centres["input-output.direction"], way, atol=1e-14)
    assert np.abs(found.centres["input-output.point"]).max() < 1e-15
    assert np.abs(found.centres["input-output.pitch"]).max() < 1e-15


LENGTHS = {"a": 0.04, "b": 0.11, "c": 0.08, "d": 0.1}


def four_bar(lengths: dict[str, float] = LENGTHS, balls: bool = False) -> md.Mechanism:
    """A planar four-bar of spatial joints; with `balls` at both ends of the coupler."""
    a, b, c, d = lengths.values()
    axis = {"axis": (0, 0, 1)}
    pin = md.Spherical if balls else md.SpatialRevolute
    more = {} if balls else axis
    return md.Mechanism(
        dimension=3,
        ground=md.Ground({"A": (0, 0, 0), "D": (d, 0, 0)}),
        bodies=[
            md.Body("crank", {"A": (0, 0, 0), "B": (a, 0, 0)}),
            md.Body("coupler", {"B": (0, 0, 0), "C": (b, 0, 0)}),
            md.Body("rocker", {"D": (0, 0, 0), "C": (c, 0, 0)}),
        ],
        joints=[
            md.SpatialRevolute("A", "ground.A", "crank.A", **axis),
            pin("B", "crank.B", "coupler.B", **more),
            pin("C", "rocker.C", "coupler.C", **more),
            md.SpatialRevolute("D", "ground.D", "rocker.D", **axis),
        ],
        sketch={"A.angle": 1.0, "crank.B.x": 0.02, "rocker.C.y": 0.08, "rocker.C.x": 0.1},
    )


def test_screw_axes_of_a_planar_mechanism_stand_on_its_instant_centres() -> None:
    """The coupler's: where the lines of crank and rocker meet; that of two links in their pin."""
    result = swept(four_bar(), "A.angle", "axodes", "screw-axes")
    own = result.bodies["coupler"]
    B, C = (result.points[name].position[:, :2] for name in ("coupler.B", "coupler.C"))
    D = np.array([LENGTHS["d"], 0.0])
    along = C - D
    share = D[0] * along[:, 1] / (B[:, 0] * along[:, 1] - B[:, 1] * along[:, 0])
    np.testing.assert_allclose(own.axode_fixed_point[:, :2], share[:, None] * B, rtol=1e-12)
    assert np.abs(own.axode_fixed_point[:, 2]).max() < 1e-15
    for pair, pin in (("crank-coupler", B), ("coupler-rocker", C)):
        np.testing.assert_allclose(result.centres[f"{pair}.point"][:, :2], pin, atol=1e-14)
    np.testing.assert_allclose(np.abs(own.axode_fixed_direction[:, 2]), 1, rtol=1e-15)
    assert np.abs(own.screw_pitch).max() < 1e-15


@pytest.mark.parametrize("name", ["bennett", "wobble-plate"])
def test_the_moving_axode_rolls_on_the_fixed_one(name: str) -> None:
    """Carried along by the body, its line at each pose is the fixed one, with one pitch."""
    problem = md.load(name)
    body, task = {"bennett": ("link2", "poses"), "wobble-plate": ("plate", "turn")}[name]
    wanted = replace(problem.tasks[task], measures=("axodes",))
    result = md.solve(problem, wanted)
    own = result.bodies[body]
    w, x, y, z = own.orientation.T
    R = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    ).transpose(2, 0, 1)
    point = next(iter(problem.mechanism.bodies[body].points))
    numbers = problem.mechanism.values()
    local = np.array([numbers[f"{body}.{point}.{axis}"] for axis in "xyz"])
    origin = result.points[f"{body}.{point}"].position - R @ local
    u = np.einsum("nij,nj->ni", R, own.axode_moving_direction)
    np.testing.assert_allclose(u, own.axode_fixed_direction, atol=1e-13)
    p = np.einsum("nij,nj->ni", R, own.axode_moving_point) + origin
    gap = np.cross(p - own.axode_fixed_point, u)
    assert np.abs(gap).max() < 1e-12 * problem.mechanism.scale
    if name == "wobble-plate":  # it turns about a point: cones
        assert np.nanmax(np.abs(own.screw_pitch)) < 1e-14


def test_bodies_that_only_shift_have_no_axis() -> None:
    problem = md.load("rssp")
    task = replace(problem.tasks["poses"], measures=("axodes", "screw-axes"))
    result = md.solve(problem, task)
    assert result.summary["axodes"] == {"never_turn": ["slider"]}
    assert "axode_fixed_point" not in result.bodies["slider"]
    assert result.summary["centres_at_infinity"] == ["ground-slider"]


# -- transmission angles ---------------------------------------------------------------------


def test_transmission_of_a_four_bar_with_ball_joints_is_that_of_the_plane() -> None:
    """cos mu = (b^2 + c^2 - BD^2) / 2 b c, extreme where the crank is in line with the ground."""
    result = swept(four_bar(balls=True), "A.angle", "transmission", from_=0.0, to=TURN, poses=9)
    a, b, c, d = LENGTHS.values()
    far = np.square(result.points["crank.B"].position - [d, 0, 0]).sum(axis=1)
    cosine = np.abs(b * b + c * c - far) / (2 * b * c)
    np.testing.assert_allclose(np.cos(result.joints["C"].transmission_angle), cosine, atol=1e-14)
    found = result.summary["transmission"]["C"]
    ends = [np.arccos(abs(b * b + c * c - (d + s * a) ** 2) / (2 * b * c)) for s in (-1, 1)]
    assert found["min"] == pytest.approx(min(ends), abs=1e-14)
    assert found["max"] == pytest.approx(np.pi / 2, abs=1e-14)  # BD^2 = b^2 + c^2 on the way


def sine_of_rssr(phi: float) -> float:
    """The transmission index of the problem `rssr`, by its closed form P cos + Q sin = R."""
    r, l, R = 0.05, 0.3, 0.15  # noqa: E741
    B = np.array([r * np.cos(phi), r * np.sin(phi), 0.0])
    D = np.array([0.12, 0.25, 0.05])  # centre of the circle of C about x
    d = D - B
    P, Q, rest = 2 * R * d[1], 2 * R * d[2], l * l - R * R - d @ d
    psi = np.arctan2(Q, P) + np.arccos(rest / np.hypot(P, Q))
    C = D + R * np.array([0, np.cos(psi), np.sin(psi)])
    tangent = np.array([0, -np.sin(psi), np.cos(psi)])
    return float(abs((C - B) @ tangent) / l)


def extreme(function, low: float, high: float) -> tuple[float, float]:
    """Place and value of the greatest value in an interval, by golden sections."""
    share = (np.sqrt(5) - 1) / 2
    for _ in range(60):
        first, second = high - share * (high - low), low + share * (high - low)
        if function(first) > function(second):
            high = second
        else:
            low = first
    return (low + high) / 2, function((low + high) / 2)


def test_transmission_of_an_rssr() -> None:
    problem = md.load("rssr")
    task = replace(problem.tasks["turn"], measures=("transmission",), poses=13)
    result = md.solve(problem, task)
    u, angle = result.drivers["A.angle"].position, result.joints["C"].transmission_angle
    np.testing.assert_allclose(np.sin(angle), [sine_of_rssr(phi) for phi in u], atol=1e-14)
    found = result.summary["transmission"]["C"]
    at, least = extreme(lambda phi: -sine_of_rssr(phi), 1.0, 2.0)
    assert found["at"] == pytest.approx(at, abs=1e-7)
    assert np.sin(found["min"]) == pytest.approx(-least, abs=1e-14)
    at, most = extreme(sine_of_rssr, 4.8, 5.8)
    assert found["max_at"] == pytest.approx(at, abs=1e-7)
    assert np.sin(found["max"]) == pytest.approx(most, abs=1e-14)
    few = md.solve(problem, replace(task, poses=3)).summary["transmission"]["C"]
    assert few == pytest.approx(found, rel=1e-12)


def test_transmission_into_a_guide() -> None:
    """The cosine of the angle between the bar and the guide."""
    problem = md.load("rssp")
    task = replace(problem.tasks["poses"], measures=("transmission",))
    result = md.solve(problem, task)
    bar = result.points["slider.C"].position - result.points["crank.B"].position
    axis = np.array(result.mechanism.joints["G"].axis, float)
    sine = np.abs(bar @ axis) / np.linalg.norm(bar, axis=1) / np.linalg.norm(axis)
    np.testing.assert_allclose(np.sin(result.joints["C"].transmission_angle), sine, atol=1e-14)


# -- what is refused -------------------------------------------------------------------------


@pytest.mark.parametrize("measure", ["axodes", "screw-axes"])
def test_axes_in_space_are_none_of_the_plane(measure: str) -> None:
    problem = md.load("four-bar-crank-rocker")
    with pytest.raises(md.MechdaeError, match="is one of space") as caught:
        md.solve(problem, replace(problem.tasks["turn"], measures=(measure,)))
    assert "centrodes" in caught.value.hint
