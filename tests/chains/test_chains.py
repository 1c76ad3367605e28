"""Chains against the counts of the literature and an isomorphism test that is not ours."""

from __future__ import annotations

import itertools
import math
from collections import Counter

import networkx
import numpy as np
import pytest

import mechdae as md
from mechdae.errors import InputError
from mechdae.parts.types.chains.chains import contracted
from mechdae.parts.types.chains.labelling import automorphisms, canonical
from mechdae.parts.types.chains.mechanisms import SIDE, joint_places

# Counts: Mruthyunjaya 2003 and Butcher and Hartman 2005 (chains), Tuttle 1996 (inversions),
# Peisach 2008 (Assur groups), Manolescu (trusses); kinds of pairs by Burnside's lemma over an
# independent list of graphs.


@pytest.mark.parametrize(
    ("freedoms", "links", "count"),
    [(1, 4, 1), (1, 6, 2), (1, 8, 16), (1, 10, 230), (0, 3, 1), (0, 5, 1), (0, 7, 3), (0, 9, 28),
     (0, 11, 562), (2, 5, 1), (2, 7, 3), (2, 9, 35), (2, 11, 753)],
)  # fmt: skip
def test_number_of_chains(freedoms: int, links: int, count: int) -> None:
    assert md.count_chains(links, freedoms) == count


@pytest.mark.parametrize(("links", "count"), [(6, 3), (8, 40), (10, 1034)])
def test_number_of_biconnected_graphs(links: int, count: int) -> None:
    assert sum(1 for _ in contracted(links, 1, rigid=True)) == count


@pytest.mark.parametrize(
    ("links", "fixed", "driven"), [(4, 1, 1), (6, 5, 9), (8, 71, 153), (10, 1834, 4506)]
)
def test_number_of_inversions_and_drivers(links: int, fixed: int, driven: int) -> None:
    assert md.count_chains(links, inversions=True) == fixed
    assert md.count_chains(links, drivers=True) == driven


@pytest.mark.parametrize(
    ("links", "count", "inverted"),
    [(4, 6, 10), (6, 96, 432), (8, 7185, 53_780), (10, 1_260_260, 12_375_500)],
)
def test_number_of_kinds_of_pairs(links: int, count: int, inverted: int) -> None:
    assert md.count_chains(links, pairs=True) == count
    assert md.count_chains(links, pairs=True, inversions=True) == inverted


@pytest.mark.parametrize(("links", "count"), [(4, 6), (6, 96), (8, 7185)])
def test_kinds_of_pairs_listed_are_as_many_as_counted(links: int, count: int) -> None:
    listed = [(chain.joints, chain.pairs) for chain in md.chains(links, pairs=True)]
    assert len(listed) == len(set(listed)) == count


@pytest.mark.parametrize(("links", "count"), [(2, 1), (4, 2), (6, 10), (8, 173), (10, 5438)])
def test_number_of_assur_groups(links: int, count: int) -> None:
    assert sum(1 for _ in md.assur_groups(links)) == count


def graph_of(chain: md.KinematicChain) -> networkx.Graph:
    graph = networkx.Graph(chain.joints)
    networkx.set_node_attributes(graph, {k: k == chain.fixed for k in graph}, "fixed")
    return graph


@pytest.mark.parametrize("links", [8, 10])
def test_no_two_chains_are_isomorphic(links: int) -> None:
    alike: dict[str, list[networkx.Graph]] = {}
    for chain in md.chains(links):
        graph = graph_of(chain)
        key = networkx.weisfeiler_lehman_graph_hash(graph, node_attr="fixed", iterations=4)
        assert not any(networkx.is_isomorphic(graph, other) for other in alike.get(key, ()))
        alike.setdefault(key, []).append(graph)
    assert sum(map(len, alike.values())) == {8: 16, 10: 230}[links]


def test_no_two_inversions_of_eight_links_are_isomorphic() -> None:
    graphs = [graph_of(chain) for chain in md.chains(8, inversions=True)]
    match = networkx.algorithms.isomorphism.categorical_node_match("fixed", False)
    for one, two in itertools.combinations(graphs, 2):
        assert not networkx.is_isomorphic(one, two, node_match=match)


@pytest.mark.parametrize("links", [6, 8, 10])
def test_chains_are_what_they_are_said_to_be(links: int) -> None:
    for chain in md.chains(links):
        graph = networkx.Graph(chain.joints)
        assert graph.number_of_nodes() == links
        assert 3 * (links - 1) - 2 * graph.number_of_edges() == 1
        assert networkx.is_biconnected(graph)


@pytest.mark.parametrize("chain", list(md.chains(8)), ids=str)
def test_no_part_is_rigid(chain: md.KinematicChain) -> None:
    graph = networkx.Graph(chain.joints)  # every set of links, not only those our filter looks at
    for size in range(2, chain.links):
        for part in itertools.combinations(range(chain.links), size):
            assert 3 * (size - 1) - 2 * graph.subgraph(part).number_of_edges() >= 1


def test_every_rigid_graph_left_out_has_a_rigid_part() -> None:
    """Of the three graphs with six links the one that is no chain has a part that cannot move."""
    lost = 0
    for graph in networkx.graph_atlas_g():  # all graphs up to seven vertices
        if graph.number_of_nodes() != 6 or graph.number_of_edges() != 7:
            continue
        if networkx.is_biconnected(graph):
            rigid = any(
                3 * (k - 1) - 2 * graph.subgraph(part).number_of_edges() < 1
                for k in range(2, 6)
                for part in itertools.combinations(range(6), k)
            )
            lost += rigid
    assert lost == 3 - md.count_chains(6)


def test_symmetries_of_the_four_bar_are_those_of_a_square() -> None:
    (chain,) = md.chains(4)
    assert len(chain.symmetries) == 8
    assert len(list(chain.with_pairs())) == 6


@pytest.mark.parametrize("links", [6, 8])
def test_symmetries_are_all_there_are(links: int) -> None:
    for chain in md.chains(links):
        graph = networkx.Graph(chain.joints)
        matcher = networkx.algorithms.isomorphism.GraphMatcher(graph, graph)
        theirs = {tuple(m[k] for k in range(links)) for m in matcher.isomorphisms_iter()}
        assert {own for own, _ in chain.symmetries} == theirs


def test_canonical_forms_of_relabelled_graphs_are_equal() -> None:
    rng = np.random.default_rng(5)
    for _ in range(60):
        size = int(rng.integers(3, 8))
        upper = np.triu(rng.integers(0, 3, (size, size)), 1)
        matrix = upper + upper.T
        colours = rng.integers(0, 2, size)
        order = rng.permutation(size)
        one = canonical(colours.tolist(), tuple(map(tuple, matrix.tolist())))
        moved = matrix[np.ix_(order, order)]
        two = canonical(colours[order].tolist(), tuple(map(tuple, moved.tolist())))
        assert one[0] == two[0]
        group = automorphisms(colours.tolist(), tuple(map(tuple, matrix.tolist())))
        brute = sum(
            bool((matrix[np.ix_(p, p)] == matrix).all() and (colours[list(p)] == colours).all())
            for p in itertools.permutations(range(size))
        )
        assert len(group) == brute


@pytest.mark.parametrize(
    ("links", "freedoms", "words"),
    [(7, 1, "6 or 8 links"), (3, 1, "4 links or more"), (16, 1, "318 162"), (6, 4, "0 to 3"),
     (6, -1, "0 to 3")],
)  # fmt: skip
def test_numbers_that_give_no_chains_are_refused(links: int, freedoms: int, words: str) -> None:
    with pytest.raises(InputError, match=words):
        next(md.chains(links, freedoms))
    with pytest.raises(InputError, match="2, 4, 6"):
        next(md.assur_groups(5))


def test_mechanisms_of_six_links_have_the_known_structures() -> None:
    """Watt: two dyads always; Stephenson: a group of four links for three of its five drivers."""
    from mechdae.tasks.show import structure

    classes = Counter()
    for chain in md.chains(6, drivers=True):
        shown = structure(md.problem_of(chain))
        assert shown["mobility"]["W"] == 1
        assert shown["mobility"]["rank"]["mobility"] == 1
        classes[max(group["class"] for group in shown["groups"])] += 1
    assert classes == {"II": 6, "III": 2, "IV": 1}


def test_mechanisms_stand_as_they_are_drawn() -> None:
    for chain in itertools.islice(md.chains(8, drivers=True), 0, None, 25):
        problem = md.problem_of(chain)
        (name,) = (driver.coordinate for driver in problem.task("range").all_drivers)
        result = md.solve(problem.mechanism, md.Sweep(driver=md.Driver(name, at=(0.0,))))
        places = SIDE * joint_places(chain)
        for reference, own in result.points.items():
            index = "ABCDEFGHJKLMNPQRSTUVWXYZ".index(reference.split(".")[1])
            assert math.hypot(*(own.position[0] - places[index])) < 1e-14


def test_prismatic_joints_are_built() -> None:
    chain = next(c for c in md.chains(4, drivers=True, pairs=True) if c.pairs == "RRRP")
    result = md.solve(md.problem_of(chain))
    assert (result.status == "ok").any()
    assert sum(isinstance(j, md.Prismatic) for j in md.mechanism_of(chain).joints.values()) == 1
