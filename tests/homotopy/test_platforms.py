"""Platforms on six legs against solutions of 25 and more digits."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.numerics.homotopy import certify, platforms
from mechdae.numerics.homotopy.platforms import (
    StudyChart,
    all_apart,
    displacement,
    from_first_leg,
    numbers_along,
    quadrics,
)
from tests.shared.paths import DATA


def turn(q: Any) -> Any:
    """Return the rotation matrices (n, 3, 3) of unit quaternions (n, 4)."""
    w, x, y, z = np.moveaxis(np.atleast_2d(q), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def test_all_forty_poses_are_real_and_proven() -> None:
    data = json.loads((DATA / "stewart_dietmaier_40.json").read_text(encoding="utf-8"))
    numbers = [np.array(data["params"][word], float) for word in ("base", "platform", "legs")]
    found = md.platform_poses(*numbers)
    assert found.proven
    assert (found.regular, found.singular, len(found.position)) == (40, 0, 40)
    R = turn(found.quaternion)
    ours = np.concatenate([found.position, R[:, :, 0], R[:, :, 1]], axis=1)
    for solution in data["solutions"]:
        wanted = np.array([float(text) for text in solution["x"]])
        assert np.abs(ours - wanted).max(axis=1).min() < 1e-9


@pytest.mark.parametrize("index", range(5))
def test_platforms_with_shared_points_and_flat_ones(index: int) -> None:
    data = json.loads((DATA / "stewart_gough.json").read_text(encoding="utf-8"))
    case = data["platforms"][index]
    numbers = [np.array(case[word], float) for word in ("base", "platform", "legs")]
    found = md.platform_poses(*numbers)
    assert (found.regular, len(found.position)) == (case["count_complex"], case["count_real"])
    assert found.regular + found.singular == 40
    assert found.proven == (case["count_complex"] == 40)
    for solution in case["solutions"]:
        place = np.array(solution["position"], float)
        R = turn(np.array(solution["quaternion"], float))[0]
        gaps = np.abs(found.position - place).max(axis=1)
        gaps += np.abs(turn(found.quaternion) - R).max(axis=(1, 2))
        assert gaps.min() < 1e-11


def test_poses_drawn_at_random_are_among_those_found() -> None:
    rng = np.random.default_rng(4)
    for _ in range(8):
        base, platform, place = rng.normal(size=(6, 3)), rng.normal(size=(6, 3)), rng.normal(size=3)
        q = rng.normal(size=4)
        R = turn(q / np.linalg.norm(q))[0]
        legs = np.linalg.norm(place + platform @ R.T - base, axis=1)
        found = md.platform_poses(base, platform, legs)
        assert found.proven
        gaps = np.abs(found.position - place).max(axis=1)
        gaps += np.abs(turn(found.quaternion) - R).max(axis=(1, 2))
        assert gaps.min() < 1e-8
        points = found.position[:, None] + np.einsum(
            "nij,kj->nki", turn(found.quaternion), platform
        )
        assert np.allclose(np.linalg.norm(points - base, axis=2), legs, rtol=1e-9)


def test_scale_does_not_matter() -> None:
    data = json.loads((DATA / "stewart_gough.json").read_text(encoding="utf-8"))["platforms"][3]
    numbers = [np.array(data[word], float) for word in ("base", "platform", "legs")]
    one = md.platform_poses(*numbers)
    small = md.platform_poses(*(1e-6 * own for own in numbers))
    assert small.proven
    order = [np.abs(small.position * 1e6 - p).max(axis=1).argmin() for p in one.position]
    assert np.allclose(small.position[order] * 1e6, one.position, rtol=1e-9, atol=1e-10)


def test_certificates_refuse_what_is_no_solution() -> None:
    p, X = platforms.generic()
    Q = quadrics(p[:18].reshape(6, 3), p[18:36].reshape(6, 3), p[36:])
    rng = np.random.default_rng(1)
    moved = X + 1e-2 * rng.normal(size=X.shape)
    assert certify.certify(X, Q).simple.all()
    assert not certify.certify(moved, Q).simple.any()
    twice = np.concatenate([X, (2 - 1j) * X[:1]])
    assert certify.apart(certify.certify(X, Q))
    assert not certify.apart(certify.certify(twice, Q))


def delta(*arms: float) -> tuple[Any, Any, Any]:
    """Return base, platform and legs of a delta robot: pairs of parallel bars on three arms."""
    base, platform = [], []
    for k, arm in enumerate(arms):
        c, s = np.cos(2 * np.pi * k / 3), np.sin(2 * np.pi * k / 3)
        for side in (-0.05, 0.05):
            along = side * np.array([-s, c, 0])
            out = 0.2 + 0.25 * np.cos(arm)
            base.append(along + np.array([out * c, out * s, -0.25 * np.sin(arm)]))
            platform.append(along + np.array([0.06 * c, 0.06 * s, 0]))
    return np.array(base), np.array(platform), np.full(6, 0.6)


def test_poses_at_infinity_are_counted_and_certified() -> None:
    """With equal arms twelve complex poses of a delta robot are at infinity, none of them real.

    They come from afar: arms that differ by a little d have them some 1/d^2 away.
    """
    found = md.platform_poses(*delta(0.2, 0.2, 0.2))
    assert found.proven
    assert (found.regular, found.far, found.singular, len(found.position)) == (28, 12, 0, 16)
    middle = np.abs(found.quaternion[:, 0]) > 1 - 1e-12  # three spheres meet in two points
    out, down = 0.2 + 0.25 * np.cos(0.2) - 0.06, 0.25 * np.sin(0.2)
    heights = np.sort(found.position[middle][:, 2])
    assert np.allclose(heights, -down + np.sqrt(0.36 - out**2) * np.array([-1, 1]), atol=1e-12)
    reach = []
    for d in (0.8, 0.4):
        near = md.platform_poses(*delta(0.2 + 0.3 * d, 0.2 - 0.1 * d, 0.2 + 0.5 * d))
        assert near.proven
        assert (near.regular, near.far) == (40, 0)
        reach.append(np.sort(np.linalg.norm(displacement(near.every), axis=1))[-12:])
    assert reach[1][0] > 1000
    assert np.allclose(reach[1] / reach[0], 4, rtol=0.1)
    for arms in ((0.2, 0.2, 0.3), (0.2001, 0.2, 0.2), (0.22, 0.19, 0.25)):
        near = md.platform_poses(*delta(*arms))
        assert near.proven
        assert near.far > 0
        assert near.regular + near.far == 40


def test_certificates_in_the_chart_refuse_what_is_no_solution() -> None:
    base, platform, legs = delta(0.2, 0.2, 0.2)
    p = from_first_leg(base, platform, legs**2)
    rng = np.random.default_rng(2)
    chart = StudyChart(rng.normal(size=4) + 1j * rng.normal(size=4))
    out, down = 0.2 + 0.25 * np.cos(0.2) - 0.06, 0.25 * np.sin(0.2)
    rise = np.sqrt(0.36 - out**2)  # not turned: e = 1, f = t / 2
    straight = np.array([[0, 0, -down - rise], [0, 0, -down + rise]])
    X = np.zeros((2, 8))
    X[:, 0] = 1.0
    X[:, 5:] = (straight + platform[0] - base[0]) / 2
    y = chart.coordinates(X.astype(complex))
    F, J, Ft = chart.system(numbers_along(p, p))(y, np.ones(2))
    assert np.abs(F).max() < 1e-14
    assert np.abs(Ft).max() < 1e-14
    step = 1e-6 * (rng.normal(size=6) + 1j * rng.normal(size=6))
    ahead, behind = (
        chart.system(numbers_along(p, p))(y + own, np.ones(2))[0] for own in (step, -step)
    )
    assert np.allclose((ahead - behind) / 2, J @ step, rtol=1e-7, atol=1e-16)
    good = chart.certify(p, y)
    assert good.simple.all()
    assert not good.other.any()
    assert all_apart(good)
    assert not chart.certify(p, y + 1e-2 * rng.normal(size=y.shape)).simple.any()
    assert not all_apart(chart.certify(p, np.concatenate([y, y[:1] + 1e-15])))


def test_what_is_refused() -> None:
    with pytest.raises(md.InputError, match="six points"):
        md.platform_poses(np.zeros((5, 3)), np.zeros((6, 3)), np.ones(6))
    with pytest.raises(md.InputError, match="above 0"):
        md.platform_poses(np.eye(6)[:, :3], np.eye(6)[:, :3], np.zeros(6))


def movable(size: float, rise: float = 1.1, turned: float = 0.7) -> tuple[Any, Any, Any]:
    """Return base, platform and legs of Griffis and Duffy: corners on middles of sides."""
    corners = np.array([[np.cos(a), np.sin(a), 0] for a in np.radians([90, 210, 330])])
    middles = (corners + np.roll(corners, -1, axis=0)) / 2
    base = np.stack([corners, middles], axis=1).reshape(6, 3)
    above = size * np.stack([middles, np.roll(corners, -1, axis=0)], axis=1).reshape(6, 3)
    R = np.array([[np.cos(turned), -np.sin(turned), 0], [np.sin(turned), np.cos(turned), 0],
                  [0, 0, 1]])  # fmt: skip
    return base, above, np.linalg.norm(above @ R.T + [0, 0, rise] - base, axis=1)


@pytest.mark.parametrize("size", [1.0, 0.6])
def test_a_platform_that_moves_by_itself_is_said_to(size: float) -> None:
    """Griffis and Duffy's platform moves at any lengths of its legs (Husty and Karger 2000)."""
    base, above, legs = movable(size)
    found = md.platform_poses(base, above, legs)
    assert (found.regular, found.singular, found.proven) == (0, 40, False)
    raised = (above + np.array([0, 0, 1.1])).tolist()
    start = {f"platform.P{k}": tuple(own) for k, own in enumerate(raised)}
    first, *others = base.tolist()
    mechanism = md.Mechanism(
        dimension=3,
        ground=md.Ground(
            {"O": (5, 0, 0)} | {f"B{k}": tuple(own) for k, own in enumerate(others, 1)}
        ),
        bodies=[
            md.Body("crank", {"O": (0, 0, 0), "B0": (first[0] - 5, *first[1:])}),
            md.Body("platform", {f"P{k}": tuple(own) for k, own in enumerate(above.tolist())}),
        ],
        joints=[
            md.SpatialRevolute("O", "ground.O", "crank.O", axis=(0, 0, 1)),
            md.Distance("leg0", "crank.B0", "platform.P0", legs[0]),
            *(
                md.Distance(f"leg{k}", f"ground.B{k}", f"platform.P{k}", legs[k])
                for k in range(1, 6)
            ),
        ],
        sketch={"O": 0.0, **start},
    )  # fmt: skip
    result = md.solve(mechanism, md.Modes(md.Driver("O.angle", at=[0.0])))
    assert result.summary["free"] == result.summary["groups"]
    assert (result.summary["count"], result.summary["proven"]) == (0, False)
    assert "moves by itself" in result.fault
    assert result.summary["search"][0]["starts"] <= 256  # and no list of the poses it can take
