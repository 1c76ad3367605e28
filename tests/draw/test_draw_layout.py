"""Labels of diagrams cover nothing: some predefined problems, random mechanisms."""

import json

import numpy as np
import pytest
from matplotlib.lines import Line2D

import mechdae as md
from mechdae.draw.labels import layout
from mechdae.draw.labels.layout import Arrangement
from mechdae.draw.labels.obstacles import Obstacles
from tests.scripts.labelling import COUNTS, MARK, _distance, count, paged, random_one, table
from tests.shared.paths import FIGURES

FIGURES = FIGURES / "labels.json"
CROWDED = ("wankel-rotor", "elliptic-trammel", "chain-of-four-bars")


@pytest.mark.parametrize("name", CROWDED)
def test_crowded_problems(name):
    problem = md.load(name)
    task = next(key for key, task in problem.tasks.items() if task.kind == "sweep")
    assert count(md.solve(problem, task, poses=25))["names"] == []


@pytest.mark.parametrize("first", range(0, 20, 5))
def test_random_mechanisms(first):
    """Only those mechanisms have covered labels that are on record."""
    figures = json.loads(FIGURES.read_text(encoding="utf-8"))
    known = {entry["seed"]: len(entry["names"]) for entry in figures["covered"]["random"]}
    drawn = 0
    for seed in range(first, first + 5):
        row = random_one(seed)
        drawn += row is not None
        if row is not None:
            assert len(row["names"]) <= known.get(seed, 0), seed
            assert row["labels_on_labels"] == row["labels_outside"] == 0
    assert drawn >= 4


@pytest.mark.parametrize("seed", [225, 257])
def test_labels_that_others_push_onto_lines_go_farther_too(seed):
    """Labels that were placed well at first, and are not once others have gone farther off."""
    assert random_one(seed)["names"] == []


def test_figures_on_record():
    figures = json.loads(FIGURES.read_text(encoding="utf-8"))
    assert figures["random"]["diagrams"] == 500
    assert table(figures) in (FIGURES.parent.parent / "theory/evidence/labels.md").read_text(
        encoding="utf-8"
    )
    assert set(COUNTS) <= set(figures["problems"])
    assert not figures["covered"]["problems"]
    for entry in (figures["problems"], figures["random"]):
        assert entry["labels_outside"] == entry["labels_on_labels"] == 0
        assert entry["diagrams_clean"] >= entry["diagrams"] - max(1, entry["diagrams"] // 100)


def test_the_page_keeps_what_follows_its_table():
    figures = json.loads(FIGURES.read_text(encoding="utf-8"))
    page = f"before\n\n{MARK}\n\n| old |\n|---|\n| 1 |\n\nafter | it\n"
    assert paged(page, figures) == f"before\n\n{MARK}\n\n{table(figures)}\nafter | it\n"
    assert paged(paged(page, figures), figures) == paged(page, figures)


def test_the_work_of_a_large_diagram_is_bounded(monkeypatch):
    """25 and 31 links, 63 and 78 labels, 300 lines: what was done, not how long."""
    done = {"places": 0, "choices": 0}
    cost, choice = Obstacles.cost, Arrangement._cost

    def counted(self, middle, half, shy):
        done["places"] += len(middle)
        return cost(self, middle, half, shy)

    def followed(self, i, places):
        done["choices"] += 1
        return choice(self, i, places)

    monkeypatch.setattr(Obstacles, "cost", counted)
    monkeypatch.setattr(Arrangement, "_cost", followed)
    chain = md.load("chain-of-four-bars")
    for loops, labels in ((12, 63), (15, 78)):
        done.update(places=0, choices=0)
        ax = md.plot(md.solve(chain.with_values({"N": loops}), "turn", poses=25))
        artists = [own for own in ax.get_children() if own.get_gid() or isinstance(own, Line2D)]
        assert (
            sum(str(own.get_gid()).startswith(("label-", "number-")) for own in artists) == labels
        )
        assert len(ax.get_children()) < 5 * labels  # many more without hatching in one piece
        assert done["places"] < 140 * labels
        assert done["choices"] < 12 * labels


def test_many_joints_near_each_other_get_a_larger_figure() -> None:
    def size(name, **values):
        ax = md.plot(md.solve(md.load(name).with_values(values), "turn", poses=25))
        return ax.get_figure(), next(a for a in ax.get_children() if a.get_gid() == "joint-G1-pin")

    usual, pin = size("chain-of-four-bars", N=5)
    assert usual.get_size_inches().tolist() == [7.0, 5.0]
    large, same = size("chain-of-four-bars", N=15)
    assert 10.0 < large.get_size_inches()[0] < 14.0
    assert large.get_size_inches()[1] == 5.0  # a long mechanism needs no height
    wide = [own.get_window_extent().width / own.get_figure().dpi for own in (pin, same)]
    assert wide[0] == pytest.approx(wide[1], rel=0.02)
    own = usual.add_axes((0, 0, 1, 1))  # axes that are given stay as they are
    md.plot(md.solve(md.load("chain-of-four-bars").with_values({"N": 15}), "turn"), ax=own)
    assert usual.get_size_inches().tolist() == [7.0, 5.0]


def test_distance_of_a_line_from_a_box_and_from_a_disc():
    low, high = np.array([0.0, 0.0]), np.array([2.0, 2.0])
    rows = np.array([[3.0, -5, 3, 5, 1], [-1, 1, 3, 1, 1], [2, 3, 3, 2, 1]], dtype=float)
    assert _distance(rows, low, high, False) == pytest.approx([1.0, 0.0, 0.5**0.5], abs=1e-3)
    assert _distance(rows, low, high, True) == pytest.approx([1.0, 0.0, 1.5 * 2**0.5 - 1])


def test_a_label_covered_everywhere_near_goes_farther():
    label = layout.around((50.0, 50.0), 8.0, 8.0, 3.0, steps=(0.0,))
    wall = [[50 - r, y, 50 + r, y, 24.0] for r in (30,) for y in np.arange(20.0, 81.0, 2.0)]
    ((x, y),) = layout.place([label], wall, [], (200.0, 200.0))
    assert max(abs(x - 50), abs(y - 50)) >= 33.0
    ((x, y),) = layout.place([label], [], [], (200.0, 200.0))
    assert np.hypot(x - 50, y - 50) < 12.0


def test_no_label_comes_between_another_and_its_joint():
    one = layout.Label(4.0, 4.0, np.array([[20.0, 0.0]]), np.zeros(1),
                       anchors=np.array([[0.0, 0, 0, 0]]))  # fmt: skip
    other = layout.Label(4.0, 4.0, np.array([[10.0, 0.0], [10.0, 9.0]]), np.array([0.0, 5.0]))
    spots = layout.place([one, other], [], [], (200.0, 200.0))
    assert spots[1] == pytest.approx([10.0, 9.0])
