"""All poses of planar linkages against counts of the literature and solutions of 25 digits."""

from __future__ import annotations

import itertools
import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.motion.assembly import group_search
from mechdae.motion.cases.larger_groups import linkage_group
from mechdae.numerics.homotopy import certified_poses, stored_instances
from mechdae.numerics.homotopy.generic_count import generic_count, sliding_count
from mechdae.numerics.homotopy.linkage import ComplexDimensions, PinLinkage, instance
from mechdae.numerics.homotopy.linkage_poses import linkage_poses
from mechdae.numerics.homotopy.stored_instances import canonical
from mechdae.parts.types.chains.chains import chains
from tests.reference.dixon import all_poses
from tests.scripts.all_modes import angles, compared, driven, missed, written
from tests.shared.paths import DATA

TRUSSES = {
    3: [2], 5: [6], 7: [14, 16, 18],
    9: [30, 36, 38, *[40] * 3, *[42] * 3, 44, 44, *[46] * 3, *[48] * 5, *[50] * 3, 52, 52, 54, 54,
        56, 58],
}  # fmt: skip
"""Complex poses of the trusses by links: Laman numbers over 2 for each mirrored link."""
PRISM = ((0, 1, 2), (3, 4, 5), (0, 3), (1, 4), (2, 5))
REAL = {"seven_link_star": 14, "six_links_four_legs": 18, "class_iv_ring": 56,
        "eight_links_five_legs": 54}  # fmt: skip


def linkage(links: Any) -> PinLinkage:
    parts = tuple(tuple(own) for own in links)
    return PinLinkage(parts, tuple(range(len(parts))))


def links_of(chain: Any) -> list[list[int]]:
    links: list[list[int]] = [[] for _ in range(chain.links)]
    for k, joint in enumerate(chain.joints):
        for link in joint:
            links[link].append(k)
    return links


def drawn(own: PinLinkage, places: Any) -> ComplexDimensions:
    """Return the dimensions of a linkage that stands with its pins at places (n,)."""
    steps = np.array([places[v] - places[u] for _, u, v, _ in own.steps])
    return ComplexDimensions.real(steps, np.zeros(0))


# -- counts --------------------------------------------------------------------------------


@pytest.mark.parametrize("links", TRUSSES)
def test_counts_of_trusses(links: int) -> None:
    found = sorted(generic_count(links_of(chain)) for chain in chains(links, 0))
    assert found == TRUSSES[links]


def test_counts_of_graphs_of_bars() -> None:
    """Laman numbers: triangle 2, three-prism 24, K33 16, a four-prism's rigid kin 56 at most."""
    assert generic_count([(0, 1), (0, 2), (1, 2)]) == 2
    triangles = [(0, 1), (0, 2), (1, 2), (3, 4), (3, 5), (4, 5)]
    assert generic_count([*triangles, (0, 3), (1, 4), (2, 5)]) == 24
    assert generic_count(list(itertools.product(range(3), range(3, 6)))) == 16
    # a pin more on two bars doubles the count (Henneberg)
    fan = [(0, 1), *[(k, n) for n in range(2, 6) for k in (n - 1, n - 2)]]
    assert generic_count(fan) == 16


def counted(own: PinLinkage) -> int | None:
    return sliding_count(own.loops, own.step_turns, own.step_slides)


def test_counts_with_slides() -> None:
    """Two circles, a circle and a line; a part whose three points are on lines (Gosselin: 2)."""
    assert counted(PinLinkage(((0, 1), (0, 2), (1, 2)), (0, 1, 2))) == 2
    assert counted(PinLinkage(((0, 1), (0, 2), (2,)), (0, 1, 0), ((0, 2),))) == 2
    three_lines = PinLinkage(((0,), (1, 2, 3)), (0, 1), ((0, 1), (0, 2), (0, 3)))
    assert three_lines.unknowns == 4
    assert counted(three_lines) == 2


@pytest.mark.parametrize("links", [5, 7])
def test_both_ways_to_count_agree(links: int) -> None:
    for chain in chains(links, 0):
        own = links_of(chain)
        assert counted(linkage(own)) == generic_count(own)


def test_the_fixed_link_and_the_order_make_no_difference() -> None:
    chain = next(iter(chains(7, 0)))
    links = links_of(chain)
    rng = np.random.default_rng(2)
    names = set()
    for _ in range(6):
        pins = rng.permutation(len(chain.joints))
        mixed = [tuple(int(pins[pin]) for pin in links[k]) for k in rng.permutation(len(links))]
        assert generic_count(mixed) == generic_count(links)
        names.add(canonical(linkage(mixed)).name)
    assert len(names) == 1
    assert len({canonical(linkage(links_of(chain))).name for chain in chains(9, 0)}) == 28


def test_dixons_determinant_has_as_many_poses() -> None:
    """Eigenvalues, which share nothing with paths and counts, of trusses drawn at random."""
    rng = np.random.default_rng(8)
    for chain in [*chains(5, 0), *chains(7, 0), *itertools.islice(chains(9, 0), 3)]:
        places = rng.normal(size=len(chain.joints)) + 1j * rng.normal(size=len(chain.joints))
        links = [{pin: complex(places[pin]) for pin in own} for own in links_of(chain)]
        assert len(all_poses(links)) == generic_count(links_of(chain))


# -- stored instances ----------------------------------------------------------------------


def test_all_trusses_to_nine_links_are_stored_with_as_many_solutions_as_a_theorem_tells(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(stored_instances, "MOST_UNKNOWNS", 0)
    for chain in itertools.chain(chains(5, 0), chains(7, 0), itertools.islice(chains(9, 0), 2)):
        found = stored_instances.instance_of(linkage(links_of(chain)))
        assert found is not None
        assert found[0].whole
        assert len(found[0].x) == generic_count(links_of(chain))
    assert len(stored_instances._shipped()) == 1 + 3 + 28


def test_stored_solutions_are_checked() -> None:
    own = canonical(linkage(PRISM)).linkage
    data = stored_instances._shipped()[stored_instances.file_name(canonical(linkage(PRISM)).name)]
    assert stored_instances.read(own, data) is not None
    n, head = own.unknowns, 2 * len(own.steps)
    twice = np.concatenate([data[:-n], data[head : head + n]])
    assert stored_instances.read(own, twice) is None
    assert stored_instances.read(own, data[:-n]) is None
    assert stored_instances.read(own, data[:-1]) is None
    assert stored_instances.read(own, data * np.nan) is None


class Shelf(dict[str, str]):
    """A folder in memory."""

    def read(self, name: str) -> str | None:
        return self.get(name)

    def write(self, name: str, text: str) -> None:
        self[name] = text


def test_what_is_computed_is_kept_and_what_is_kept_is_checked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    links = linkage([(0, 1), (0, 2), (1, 2)])
    shelf = Shelf()
    monkeypatch.setattr(stored_instances, "_known", {})
    found = stored_instances.instance_of(links, shelf)
    assert found is not None
    assert (len(found[0].x), len(shelf)) == (2, 1)

    def never(*given: Any) -> None:
        raise AssertionError("computed again")

    monkeypatch.setattr(stored_instances, "_known", {})
    monkeypatch.setattr(stored_instances, "generic_instance", never)
    again = stored_instances.instance_of(links, shelf)
    assert again is not None
    assert np.abs(again[0].x - found[0].x).max() < 1e-12
    (name,) = shelf
    for text in ("", "no base 64 ü", shelf[name][:-8], "AAAA" * 40):
        monkeypatch.setattr(stored_instances, "_known", {})
        with pytest.raises(AssertionError, match="computed again"):
            stored_instances.instance_of(links, Shelf({name: text}))


# -- certificates --------------------------------------------------------------------------


def slotted() -> PinLinkage:
    """Return a bar and a part with a slot for a pin of another part that slides on the ground."""
    return PinLinkage(((0, 1), (0, 2), (1, 3), (4,)), (0, 1, 2, 0), ((3, 2), (1, 3)))


def test_equations_and_their_derivatives() -> None:
    own, rng = slotted(), np.random.default_rng(3)
    numbers, x = instance(own, rng)
    other = ComplexDimensions.drawn(own, rng)
    system = own.system([numbers, other])
    assert np.abs(system(x[None], np.zeros(1))[0]).max() < 1e-14
    at, step = np.array([0.3]), 1e-6
    _, J, rate = system(x[None], at)
    ahead, behind = (system(x[None], at + s)[0] for s in (step, -step))
    assert np.abs((ahead - behind) / (2 * step) - rate).max() < 1e-8
    for k in range(own.unknowns):
        e = step * np.eye(own.unknowns)[k]
        slope = (system((x + e)[None], at)[0] - system((x - e)[None], at)[0]) / (2 * step)
        assert np.abs(slope - J[:, :, k]).max() < 1e-8


def test_certificates_hold_what_they_say() -> None:
    """Solutions moved within the second radius are no others; far from one nothing is certified."""
    own = canonical(linkage(PRISM)).linkage
    data = stored_instances._shipped()[stored_instances.file_name(canonical(linkage(PRISM)).name)]
    found = stored_instances.read(own, data)
    assert found is not None
    numbers, x = found.numbers, found.x
    sure = certified_poses.certify(own, numbers, x, real=False)
    assert sure.simple.all()
    assert certified_poses.apart(sure)
    assert not certified_poses.apart(certified_poses.certify(own, numbers, x[[0, 1, 0]], False))
    rng = np.random.default_rng(5)
    far = x + 0.3 * rng.normal(size=x.shape)
    assert not certified_poses.certify(own, numbers, far, real=False).simple.any()
    near = x + 1e-7 * rng.normal(size=x.shape)
    moved = certified_poses.certify(own, numbers, near, real=False)
    gaps = np.linalg.norm((moved.y - sure.y) / moved.size, axis=1)
    assert (gaps[moved.simple] <= moved.radius[moved.simple] * 1.01).all()
    assert moved.simple.all()


# -- all modes -----------------------------------------------------------------------------


def placed(order: Any, inside: list[dict[int, complex]]) -> ComplexDimensions:
    """Return the dimensions of links with pins at places in their frames."""
    steps = [
        inside[order.parts[j]][order.pins[v]] - inside[order.parts[j]][order.pins[u]]
        for j, u, v, _ in order.linkage.steps
    ]
    return ComplexDimensions.real(np.array(steps), np.zeros(0))


def test_the_star_with_fourteen_real_poses() -> None:
    """Three links on the ground, joined by three bars: 14 of 14 poses are real (26 digits)."""
    case = json.loads((DATA / "baranov7_star.json").read_text(encoding="utf-8"))
    feet, first, second = (
        [complex(float(x), float(y)) for x, y in case["params"][key]] for key in ("O", "p", "q")
    )
    inside = [dict(enumerate(feet))]
    inside += [{k: 0, 3 + k: first[k], 6 + k: second[k]} for k in range(3)]
    for k, length in enumerate(case["params"]["bars"]):
        inside.append({6 + k: 0, 3 + (k + 1) % 3: float(length)})
    found = stored_instances.instance_of(linkage(inside))
    assert found is not None
    start, order = found
    poses = linkage_poses(start, placed(order, inside))
    assert poses.proven
    assert (poses.generic, len(poses.turns)) == (14, 14)
    turned = np.zeros((14, 7))
    turned[:, list(order.turns)] = np.concatenate([np.zeros((14, 1)), poses.turns], axis=1)
    ours = np.exp(1j * (turned - turned[:, :1]))[:, 1:4]
    for solution in case["solutions"]:
        wanted = np.exp(1j * np.array([float(angle) for angle in solution]))
        assert np.abs(ours - wanted).max(axis=1).min() < 1e-11


def test_the_prism_with_twenty_four_real_poses() -> None:
    """Lengths of Borcea and Streinu's kind: with either triangle mirrored, 24 real ones in all."""
    z12 = z13 = z23 = 2.0
    z14, z36, z25, z45, z46, z56 = 7 / 4, 27 / 10, 197 / 100, 11 / 5, 29 / 10, 43 / 20

    def triangle(a: float, b: float, c: float) -> list[complex]:
        x = (a * a + b * b - c * c) / (2 * a)
        return [0, a, x + 1j * np.sqrt(b * b - x * x)]

    base, plate = triangle(z12, z13, z23), triangle(z45, z46, z56)
    own = linkage(((1, 2, 3), (4, 5, 6), (1, 4), (2, 5), (3, 6)))
    found = stored_instances.instance_of(own)
    assert found is not None
    start, order = found
    total = 0
    for top in (plate, [np.conj(z) for z in plate]):
        inside = [
            dict(zip((1, 2, 3), base, strict=True)), dict(zip((4, 5, 6), top, strict=True)),
            {1: 0, 4: z14}, {2: 0, 5: z25}, {3: 0, 6: z36},
        ]  # fmt: skip
        poses = linkage_poses(start, placed(order, inside))
        assert poses.proven
        total += 2 * len(poses.turns)  # and all mirrored
    assert total == 24


@pytest.mark.parametrize(
    ("links", "number", "set_"), [(7, 3, 0), (9, 100, 0), (9, 5, 16), (9, 47, 8)]
)
def test_modes_are_those_that_eigenvalues_give(links: int, number: int, set_: int) -> None:
    """Paths used to stop before modes 0.0013 apart, and where a link went round three times."""
    every = [chain for truss in chains(links, 0) for chain in truss.inversions()]
    rng = np.random.default_rng([links, number])
    rng.normal(size=(set_, len(every[number].joints), 2))
    row = compared(every[number], rng, searched=False)
    assert row["proven"]
    assert row["eigenvalues"] == [row["complex"], row["real"], 0, 0]


def with_slides(kinds: str, number: int) -> md.Mechanism:
    """Return a group of six links drawn at random, with pairs of these kinds."""
    every = [chain for truss in chains(7, 0) for chain in truss.inversions()]
    chain = replace(every[number], pairs=kinds)
    return driven(chain, np.random.default_rng(number).normal(size=(len(kinds), 2)))


def test_groups_with_slides_are_proven(monkeypatch: pytest.MonkeyPatch) -> None:
    """As many generic poses as monodromy finds without being told; the search finds no others."""
    mechanism, task = with_slides("RRRRPPRRR", 4), md.Modes(md.Driver("crank.angle", at=[0.0]))
    seen: list[PinLinkage] = []
    kept = linkage_group.instance_of

    def instance_of(own: PinLinkage, folder: Any) -> Any:
        seen.append(own)
        return kept(own, folder)

    monkeypatch.setattr(linkage_group, "instance_of", instance_of)
    found = md.solve(mechanism, task)
    assert found.summary["proven"]
    own = canonical(seen[0]).linkage
    count = own.count
    monkeypatch.setattr(PinLinkage, "count", None)
    assert len(stored_instances.generic_instance(own, seed=2)[1]) == count
    monkeypatch.setattr(group_search, "of_cases", lambda question: [])
    other = md.solve(mechanism, task)
    assert "search from many starts" in other.summary["basis"]  # proven box by box, or not
    assert missed(angles(found), angles(other)) == 0
    assert found.summary["count"] == other.summary["count"]


@pytest.mark.parametrize("group", REAL)
def test_larger_groups_have_all_their_modes_proven(group: str) -> None:
    data = json.loads((DATA / "planar_groups.json").read_text(encoding="utf-8"))
    case = data["groups"][group][0]
    mechanism = written(case)
    driver = md.Driver("crank.angle", at=[float(case["crank_angle"])])
    result = md.solve(mechanism, md.Modes(driver))
    summary = result.summary
    assert summary["proven"]
    assert f"{REAL[group]} complex poses are certified" in summary["basis"]
    assert "singular_paths" not in summary
    assert summary["count"] == len(case["solutions"])
    bodies = [name for name in result.bodies if name != "crank"]
    ours = np.exp(1j * np.stack([result.bodies[name].angle for name in bodies], axis=1))
    for solution in case["solutions"]:
        wanted = np.exp(1j * np.array([float(solution[name]) for name in bodies]))
        assert np.abs(ours - wanted).max(axis=1).min() < 1e-11


def prism(first: float = 1.5) -> md.Mechanism:
    """Return two equal triangles on three legs of 1.5 m, the first leg as given, on a crank."""
    corners = [(0.0, 0.0), (2.0, 0.1), (0.7, 1.6)]
    bodies = [
        md.Body("crank", {"C": (0, 0), "A0": (1.0, 0)}),
        md.Body("plate", {f"B{k}": corners[k] for k in range(3)}),
    ]
    joints = [md.Revolute("C", "ground.C", "crank.C")]
    for k, length in enumerate((first, 1.5, 1.5)):
        bodies.append(md.Body(f"leg{k}", {"A": (0, 0), "B": (length, 0)}))
        below = "crank.A0" if k == 0 else f"ground.A{k}"
        joints.append(md.Revolute(f"A{k}", below, f"leg{k}.A"))
        joints.append(md.Revolute(f"B{k}", f"leg{k}.B", f"plate.B{k}"))
    ground = md.Ground({"C": (-1.0, 0.0), "A1": corners[1], "A2": corners[2]})
    sketch = {"crank": 0.0, "plate": 0.0, "leg0": 0.9, "leg1": 0.9, "leg2": 0.9}
    return md.Mechanism(ground=ground, bodies=bodies, joints=joints, sketch=sketch)


def test_special_dimensions_are_not_called_proven() -> None:
    """Of the movable prism's six complex poses some are a whole curve of poses."""
    own = linkage(PRISM)
    found = stored_instances.instance_of(own)
    assert found is not None
    places = np.array([0, 2 + 0.1j, 0.7 + 1.6j, 0.9 + 1.2j, 2.9 + 1.3j, 1.6 + 2.8j])
    start, order = found
    numbers = drawn(order.linkage, places[list(order.pins)])
    poses = linkage_poses(start, numbers)
    assert not poses.proven
    assert poses.singular > 0


def two_parallelograms(**sketch: float) -> md.Mechanism:
    """Return two plates on a common pin, each on two equal legs: they move by themselves."""
    plates = [
        md.Body("left", {"a": (0, 0), "b": (1, 0), "p": (1.6, 0.5)}),
        md.Body("right", {"p": (0, 0), "a": (0.9, -0.3), "b": (2.4, -0.4)}),
    ]
    bodies = [md.Body("crank", {"C": (0, 0), "A0": (1.0, 0)}), *plates]
    joints = [md.Revolute("C", "ground.C", "crank.C"), md.Revolute("P", "left.p", "right.p")]
    for k, pin in enumerate(("left.a", "left.b", "right.a", "right.b")):
        bodies.append(md.Body(f"leg{k}", {"A": (0, 0), "B": (1.5, 0)}))
        below = "crank.A0" if k == 0 else f"ground.A{k}"
        joints.append(md.Revolute(f"A{k}", below, f"leg{k}.A"))
        joints.append(md.Revolute(f"B{k}", f"leg{k}.B", pin))
    ground = {"C": (-1.0, 0.0), "A1": (1, 0.0), "A2": (2.5, 0.2), "A3": (4, 0.1)}
    return md.Mechanism(ground=md.Ground(ground), bodies=bodies, joints=joints, sketch=sketch)


def test_modes_in_which_a_group_moves_by_itself_are_not_counted() -> None:
    """Sketched on a mode that is rigid; the legs of the moving ones are parallel."""
    sketch = {"crank": 0.0, "left": 0.8, "right": -1.4, "leg0": -2.8, "leg1": -2.9, "leg2": 1.9}
    mechanism = two_parallelograms(**sketch, leg3=2.5)
    result = md.solve(mechanism, md.Modes(md.Driver("crank.angle", at=[0.0])))
    summary = result.summary
    (group,) = summary["groups"]
    assert summary["free"] == [group]
    assert not summary["proven"]
    assert summary["singular_paths"] == 6
    assert 0 < summary["count"] <= 12
    assert summary["search"][0]["starts"] == 256
    legs = np.stack([result.bodies[f"leg{k}"].angle for k in range(4)], axis=1)
    for own in legs:
        assert max(abs(np.sin((own[0] - own[1]) / 2)), abs(np.sin((own[2] - own[3]) / 2))) > 1e-3
