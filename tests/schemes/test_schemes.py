"""Schemes of dyads: closed forms, measure and growth against truths that owe them nothing."""

from __future__ import annotations

import numpy as np
import pytest

import mechdae as md
from mechdae.parts.types.schemes.closure import material, turned
from mechdae.parts.types.schemes.descent import POINTS, Refinement
from mechdae.parts.types.schemes.designs import PATH, certified, problem_of_scheme, tracer
from mechdae.parts.types.schemes.growth import grown, merged
from mechdae.parts.types.schemes.placed_design import PlacedDesign
from mechdae.parts.types.schemes.scheme import DYAD, RIGID, read
from mechdae.parts.types.schemes.screening import reaching, screened
from mechdae.parts.types.schemes.shape import Wanted, distances, resampled
from mechdae.parts.types.schemes.types import chain_names, schemes_of
from tests.reference.circles import followed, of_file

TURN = 2 * np.pi
SHORT = "F C F D1.2 R1.3 *4"
STEPHENSON = "F C F D1.2 F R1.3 D4.5 R5.6 *7"
WATT = "F C F D1.2 R1.3 R0.1 D4.5 *6"


def drawn(text: str, count: int, seed: int = 0):
    """Return sets of dimensions (count, n) that assemble over a turn."""
    scheme, generator = read(text), np.random.default_rng(seed)
    angles = TURN * np.arange(64) / 64
    x = np.zeros((scheme.size, count, 64), complex)
    for k, (kind, i, j) in enumerate(scheme.points):
        if kind == "F":
            spot = generator.normal(0, 2, (count, 2)) * (k > 0)
            x[k] = (spot[:, 0] + 1j * spot[:, 1])[:, None]
        elif kind == "C":
            x[k] = np.exp(1j * angles)
        elif kind == RIGID:
            share = generator.normal(0.5, 0.7, (count, 2))
            x[k] = x[i] + (share[:, 0] + 1j * share[:, 1])[:, None] * (x[j] - x[i])
        elif kind == DYAD:
            a, b, side = reaching(x[i], x[j], generator)
            far = np.abs(x[j] - x[i])
            foot = (a**2 - b**2 + far**2) / (2 * far)
            up = 1j * side * np.sqrt(a**2 - foot**2)
            x[k] = x[i] + (x[j] - x[i]) / far * (foot + up)
    return scheme, x[:, :, 0].T


@pytest.mark.parametrize("text", [SHORT, STEPHENSON, WATT])
def test_closed_forms_are_the_certified_positions(text: str) -> None:
    scheme, places = drawn(text, 1)
    problem = problem_of_scheme(scheme, PlacedDesign(places[0], {}, {}), "scheme", "")
    found = certified(problem, tracer(scheme))
    assert not found.reasons
    turn = turned(scheme, places, TURN * np.arange(720) / 720)
    size = np.abs(places).max()
    assert np.abs(found.curve - turn.x[scheme.trace, 0]).max() < 1e-12 * size
    # the least sine of the dyads is that of the least transmission angle, between samples too
    assert np.sin(found.transmission) == pytest.approx(turn.least[0], abs=1e-3)
    assert np.sin(found.transmission) <= turn.least[0] + 1e-12
    spots, links = of_file(md.dumps(problem))
    points, _ = followed(spots, links, TURN * np.arange(720) / 720)
    assert np.abs(points["P"] - found.curve).max() < 1e-12 * size


@pytest.mark.parametrize("text", [SHORT, STEPHENSON, WATT])
def test_derivatives_are_those_of_differences(text: str) -> None:
    scheme, places = drawn(text, 8)
    angles, h = TURN * np.arange(48) / 48, 1e-6
    turn = turned(scheme, places, angles, derivatives=True)
    curve = resampled(turn.x[scheme.trace], 40)
    at_points = curve.derivatives(turn.derivatives)
    amount, slopes = material(scheme, places, slopes=True)
    bars = sum(np.abs(places[:, j] - places[:, i]) for i, j in scheme.bars)
    assert np.allclose(amount, 2 * bars, rtol=1e-14)
    rows = np.arange(len(places))
    for k in range(1, scheme.size):
        for part, step in enumerate((h, 1j * h)):
            column = 2 * k - 2 + part
            ends = [places.copy(), places.copy()]
            ends[0][:, k] += step
            ends[1][:, k] -= step
            one, other = (turned(scheme, own, angles) for own in ends)
            rate = (one.x[scheme.trace] - other.x[scheme.trace]) / (2 * h)
            size = 1 + np.abs(rate).max()
            assert np.abs(rate - turn.derivatives[:, :, column]).max() < 1e-6 * size
            curves = [resampled(own.x[scheme.trace], 40).points for own in (one, other)]
            rate = (curves[0] - curves[1]) / (2 * h)
            assert np.abs(rate - at_points[:, :, column]).max() < 1e-5 * size
            rate = (material(scheme, ends[0]) - material(scheme, ends[1])) / (2 * h)
            assert np.abs(rate - slopes[:, column]).max() < 1e-7
            for dyad, (at, slope) in turn.slopes.items():
                rate = (one.sines[dyad][rows, at] - other.sines[dyad][rows, at]) / (2 * h)
                assert np.abs(rate - slope[:, column]).max() < 1e-6


def test_the_measure_is_that_of_closed_forms() -> None:
    s = TURN * np.arange(720) / 720
    circle = Wanted(3.0 * np.exp(1j * s) + 5)
    assert circle.radius == pytest.approx(3.0, rel=1e-4)
    # circles of other sizes: each point is off by the difference of the radii
    for share in (0.9, 1.25):
        own = distances(share * np.exp(1j * s)[None] + 7, circle)[0]
        assert own == pytest.approx(TURN * abs(share - 1), rel=1e-3)
    # a curve moved, turned, begun elsewhere and run backward is the same one
    egg = (1 + 0.3 * np.cos(s) + 0.1 * np.sin(2 * s)) * np.exp(1j * s)
    wanted = Wanted(egg)
    plain = (egg - wanted.center) / wanted.radius
    moved = np.roll(plain, 252)[::-1] * np.exp(0.7j) + 3 - 2j
    assert distances(plain[None], wanted)[0] < 1e-12
    assert distances(moved[None], wanted)[0] < 0.02  # it begins between two of the 200 points
    # a mirrored one is another
    assert distances(np.conj(plain)[None], wanted)[0] > 0.1


def test_the_measure_is_the_best_of_all_shifts() -> None:
    """Compared with all shifts of both senses, each with its rotation, one after the other."""
    s = TURN * np.arange(400) / 400
    wanted = Wanted(np.exp(1j * s) + 0.4 * np.exp(-2j * s))
    curve = 0.9 * np.exp(1j * s) + 0.3j * np.exp(-2j * s + 0.4j) + 0.1 * np.exp(3j * s)
    target = wanted.points(200)
    own = resampled(curve[None], 200).points[0]
    own, target = own - own.mean(), target - target.mean()
    found = []
    for way in (target, target[::-1]):
        for k in range(200):
            shifted = np.roll(way, k)
            turn = np.vdot(own, shifted)
            gaps = np.abs(own * turn / abs(turn) - shifted)
            found.append(TURN * gaps.mean())
    assert distances(curve[None], wanted)[0] == pytest.approx(min(found), rel=1e-12)


@pytest.mark.parametrize(("links", "count"), [(4, 1), (6, 11)])
def test_schemes_of_chains(links: int, count: int) -> None:
    """Six links by hand: two cranks of each chain whose groups are dyads, and where they trace."""
    found = [own for k in range(len(chain_names(links))) for own in schemes_of(links, k + 1)]
    assert len({own.text for own in found}) == count
    for scheme in found:
        assert len(scheme.links) == links
        assert scheme.joints == (3 * links - 4) // 2
        assert all(len(own) > 1 for own in scheme.links)
        assert scheme.pruned()[0] == scheme


@pytest.mark.parametrize("text", [SHORT, STEPHENSON, WATT])
def test_growth_changes_no_motion(text: str) -> None:
    scheme, places = drawn(text, 1, seed=1)
    angles = TURN * np.arange(48) / 48
    before = turned(scheme, places, angles).x[scheme.trace, 0]
    generator = np.random.default_rng(0)
    sizes = set()
    for change in grown(scheme):
        for further in [None, *list(grown(change.scheme))[:4]]:
            own, parent, sets = change, scheme, places[0]
            if further is not None:
                sets = change.places(scheme, places[0], 1, generator)[0]
                own, parent = further, change.scheme
            turn = turned(own.scheme, own.places(parent, sets, 2, generator), angles)
            assert np.abs(turn.x[own.scheme.trace] - before).max() < 1e-9
            assert own.scheme.pruned()[0].size == own.scheme.size
        sizes.add(change.scheme.size - scheme.size)
    assert sizes == {1, 2}


def test_merging_leaves_schemes_of_fewer_points() -> None:
    scheme = read(STEPHENSON)
    found = list(merged(scheme))
    assert found
    for change in found:
        assert change.scheme.size < scheme.size
        assert change.scheme.joints >= 4


def test_refinement_finds_a_planted_four_bar() -> None:
    """From its dimensions disturbed back to the curve, with material below a limit where asked."""
    scheme = read(SHORT)
    spots = np.array([0, 1, 2.4 + 0.3j, 1.9 + 2.1j, 0.6 + 2.2j])
    angles = TURN * np.arange(720) / 720
    wanted = Wanted(turned(scheme, spots[None], angles).x[scheme.trace, 0])
    target = wanted.points(POINTS)
    generator = np.random.default_rng(2)
    noise = generator.normal(0, 0.1, (2, 6, 5))
    start = (spots + noise[0] + 1j * noise[1]) / wanted.radius
    start -= start[:, :1]
    limits = np.full(6, np.inf)
    run = Refinement(scheme, start, target - target.mean(), limits, np.full(6, 0.05))
    found = run.run(60)
    curve = turned(scheme, found, angles).x[scheme.trace]
    assert np.sort(distances(curve, wanted))[:4].max() < 2e-3
    limits = np.full(6, 0.9 * material(scheme, spots[None] / wanted.radius)[0])
    run = Refinement(scheme, start, target - target.mean(), limits, np.full(6, 0.05))
    amounts = material(scheme, run.run(60))
    assert (amounts <= 1.02 * limits).sum() >= 5


def test_screened_sets_assemble_and_are_near() -> None:
    s = TURN * np.arange(400) / 400
    wanted = Wanted((1 + 0.25 * np.cos(s)) * np.exp(1j * s))
    target = wanted.points(64)
    scheme = read(SHORT)
    target = target - target.mean()
    places, residual = screened(scheme, target, 400, [1], 5, [np.inf, 9.0])
    turn = turned(scheme, places, TURN * np.arange(64) / 64)
    assert (turn.least > 0).all()
    assert len(places) > 5
    curve = resampled(turn.x[scheme.trace], 64).points
    curve = curve - curve.mean(axis=1, keepdims=True)
    # turned and sized as they are they lie on the wanted curve with that residual
    gaps = [min(np.mean(np.abs(own - np.roll(way, k)) ** 2) for k in range(64)
                for way in (target, target[::-1])) for own in curve]  # fmt: skip
    assert np.allclose(gaps, residual, rtol=1e-9, atol=1e-12)
    assert (material(scheme, places[5:]) <= 9.0).all()


def test_a_design_is_a_problem_of_its_own() -> None:
    scheme, places = drawn(WATT, 1)
    problem = problem_of_scheme(scheme, PlacedDesign(places[0], {}, {}), "watt", "Watt")
    import tomllib

    from mechdae.describe.file.load import from_dict

    again = from_dict(tomllib.loads(md.dumps(problem)))
    found = md.solve(again, PATH)
    assert {str(word) for word in found.status} == {"ok"}
    assert len(again.mechanism.joints) == scheme.joints == 7
