"""A group of six links with fourteen poses: by paths, and by a search from many starts."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import mechdae as md
from mechdae.motion.assembly import group_search
from mechdae.results.tables import table

AT = md.Modes(md.Driver("crank.angle", at=[0.0]))

STAR = """
-3.1337440541721567070 -1.1436898801713201835 0.97351168341658483816
-3.1111007773512034469 1.24420807964930642609 2.85919606876675456767
-2.7007876472078093188 -0.8316549465454765144 1.45685532815001194816
-2.5197833355527662410 0.63357441536461033837 1.65565646509106274896
-2.4569455197404452514 -0.6673160608114678028 2.44504171744180803327
-1.8413292030198606545 -0.6433955281812648638 2.08597014931898475780
-1.8185213670334125331 -0.6654609841869793375 2.43458338534205620771
-0.9908789692534354949 0.62755120563961690920 1.57125317793120478947
-0.0955447684124715657 -2.1395674712894171044 -1.8597798135268770456
0.37916254541116527210 1.52508716695209934433 -0.2751520167793684791
0.39395457765113822495 -2.2649593316016595218 -0.3486403574979978064
1.98375189237042151989 -1.9086635184833436147 -2.0203128391459364473
2.00488175977753817842 1.82011925372180389111 -0.5258317082214007636
2.68213831249489276968 1.57696284629995467767 -3.0176905198180702784
"""
"""Angles of the three links, all 14 poses (degree 14; 26 digits by an independent elimination)."""


def star() -> md.Mechanism:
    """Return the seven-link truss of three links and three bars, one pivot on a crank."""
    pivots = [(0.0, 0.0), (3.79, 0.0), (1.46, 4.46)]
    p = [(1.7, 0.24), (1.62, 0.35), (1.63, 0.35)]
    q = [(-0.43, 0.94), (-0.92, 1.73), (-0.84, 1.16)]
    bars = [4.36, 5.31, 4.98]
    bodies = [md.Body("crank", {"C": (0, 0), "O1": (0.5, 0)})]
    joints = [md.Revolute("C", "ground.C", "crank.C")]
    for k in (1, 2, 3):
        after = k % 3 + 1
        bodies.append(md.Body(f"link{k}", {"O": (0, 0), "p": p[k - 1], "q": q[k - 1]}))
        bodies.append(md.Body(f"bar{k}", {"q": (0, 0), "p": (bars[k - 1], 0)}))
        pivot = "crank.O1" if k == 1 else f"ground.O{k}"
        joints.append(md.Revolute(f"O{k}", pivot, f"link{k}.O"))
        joints.append(md.Revolute(f"q{k}", f"link{k}.q", f"bar{k}.q"))
        joints.append(md.Revolute(f"p{k}", f"bar{k}.p", f"link{after}.p"))
    ground = md.Ground({"C": (-0.5, 0), "O2": pivots[1], "O3": pivots[2]})
    return md.Mechanism(ground=ground, bodies=bodies, joints=joints)


@pytest.mark.parametrize("searched", [False, True])
def test_all_fourteen_poses_of_a_star(monkeypatch, searched: bool) -> None:
    if searched:
        monkeypatch.setattr(group_search, "of_cases", lambda question: [])
    result = md.solve(star(), AT)
    summary = result.summary
    assert summary["proven"] != searched
    assert summary["count"] == 14
    if searched:
        (entry,) = summary["search"]
        assert entry["group"] == "VI 6 links(2,3,4,5,6,7)"
        assert entry["found"] == 14
        assert entry["starts"] <= 2048
        assert entry["least_hits"] >= 4
        assert "searched: VI 6 links(2,3,4,5,6,7): 14 found from" in table(result)
    else:
        assert "search" not in summary
        assert "14 complex poses are certified, as many as there can be" in summary["basis"]
        assert "basis: VI 6 links(2,3,4,5,6,7): homotopy: 14" in table(result)
    wanted = np.exp(1j * np.array(STAR.split(), float).reshape(-1, 3))
    ours = np.exp(1j * np.stack([result.bodies[f"link{k}"].angle for k in (1, 2, 3)], axis=1))
    for row in wanted:
        assert np.abs(ours - row).max(axis=1).min() < 1e-12


@pytest.mark.parametrize("searched", [False, True])
def test_a_star_without_a_pose(monkeypatch, searched: bool) -> None:
    if searched:
        monkeypatch.setattr(group_search, "of_cases", lambda question: [])
    mechanism = star()
    bodies = {**mechanism.bodies, "bar1": md.Body("bar1", {"q": (0, 0), "p": (40.0, 0)})}
    result = md.solve(replace(mechanism, bodies=bodies), AT)
    assert (result.summary["count"], result.summary["proven"]) == (0, not searched)
    assert ("no pose was found by Newton's method from" in result.fault) == searched
    # a bar of 40 m between links of 2 m
    found = re.search(r"joint ([pq]1) stays open by ([0-9.]+) m", result.fault)
    assert found is not None
    assert 10 < float(found[2]) < 40


def test_the_sketch_is_the_first_start_of_a_search() -> None:
    wanted = np.array(STAR.split(), float).reshape(-1, 3)
    for row in wanted[::7]:
        sketch = {f"link{k}": row[k - 1] + 0.02 for k in (1, 2, 3)}
        mechanism = replace(star(), sketch={"crank": 0.0, **sketch})
        result = md.solve(
            mechanism, md.Sweep(md.Driver("crank.angle", from_=0.0, to=0.01), poses=3)
        )
        for k in (1, 2, 3):
            angle = result.bodies[f"link{k}"].angle[0]
            assert abs(np.exp(1j * angle) - np.exp(1j * row[k - 1])) < 1e-12
