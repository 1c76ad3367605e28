"""Rankings: figures against single solutions, fronts and intervals against brute force."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.numerics.dominance import undominated
from mechdae.parts.types.drawn import ranking_pictures as pictures
from mechdae.parts.types.ranking.rank import checked, intervals, ordered, shares
from tests.scripts.ranking_by_hand import CASES, compared
from tests.shared.paths import ROOT

FOUR_BAR = "four-bar-crank-rocker"


@pytest.mark.parametrize(
    ("name", "by", "count"),
    [("slider-crank-inertia", "construction", 3), (FOUR_BAR, "order", 3)],
)
def test_figures_are_those_of_the_exported_files(name: str, by: str, count: int) -> None:
    row = compared(name, by, count, seed=7, poses=25)
    assert row["largest_difference"] <= 1e-13
    assert row["same_order"]


def test_fifty_variants_were_compared() -> None:
    rows = json.loads((ROOT / "docs" / "data" / "ranking.json").read_text())
    assert sum(row["variants"] for row in rows) == sum(count for *_, count in CASES) == 50
    assert max(row["largest_difference"] for row in rows) <= 1e-13
    assert all(row["same_order"] for row in rows)


def test_front_is_that_of_pairs() -> None:
    costs = np.random.default_rng(1).integers(0, 4, (60, 3)).astype(float)
    flags = undominated(costs)
    for k, own in enumerate(costs.tolist()):
        beaten = any(
            all(a <= b for a, b in zip(other, own, strict=True)) and other != own
            for other in costs.tolist()
        )
        assert flags[k] != beaten


def test_intervals_by_bisection() -> None:
    generator = np.random.default_rng(2)
    for _ in range(40):
        costs = shares(generator.random((12, 4)), ["min", "max", "min", "min"])
        weights = generator.dirichlet(np.ones(4))
        best = ordered(costs, weights)[0]
        for k, (low, high) in enumerate(intervals(costs, list(weights), best)):

            def first(weight: float, k: int = k, own: object = weights, c: object = costs) -> int:
                rest = np.delete(own, k)  # type: ignore[call-overload]
                changed = np.insert(rest / rest.sum() * (1 - weight), k, weight)
                return int(np.argmin(c @ changed))  # type: ignore[operator]

            for end, out in ((low, 0.0), (high, 1.0)):
                inside, outside = float(weights[k]), out
                if first(out) == best:
                    assert end == out
                    continue
                for _ in range(60):
                    middle = (inside + outside) / 2
                    if first(middle) == best:
                        inside = middle
                    else:
                        outside = middle
                assert end == pytest.approx(inside, abs=1e-9)


def test_rounding_is_no_difference() -> None:
    values = np.array([[1.0, 3.0], [1.0 + 2e-16, 2.0]])
    assert shares(values, ["min", "max"]).tolist() == [[0.0, 0.0], [0.0, 1.0]]


def test_weights_that_do_not_add_up() -> None:
    assert checked(None, ["a", "b"]) == {"a": 0.5, "b": 0.5}
    with pytest.raises(md.InputError, match=r"add up to 0\.9, not to 1"):
        checked({"a": 0.5, "b": 0.4}, ["a", "b"])
    with pytest.raises(md.UnknownName, match="width"):
        checked({"widht": 1.0}, ["width", "height"])
    with pytest.raises(md.InputError, match="0 or more"):
        checked({"a": 1.5, "b": -0.5}, ["a", "b"])
    with pytest.raises(md.InputError, match="not nan"):
        checked({"a": float("nan")}, ["a"])


def test_size_comes_first() -> None:
    free = md.rank(FOUR_BAR, by="order", weights={"height": 1.0})
    assert free.order[0] == "order-coupler-crank-rocker"
    low = md.rank(FOUR_BAR, by="order", weights={"height": 1.0}, within={"width": 0.15})
    assert low.order == ("order-crank-rocker-coupler",)
    why = {row.name: row.why for row in low.rows}
    assert why["order-coupler-crank-rocker"].startswith("width 0.1573")
    assert free.missing == {"transmission_angle": ("order-coupler-crank-rocker",)}


def test_what_does_not_assemble_is_listed() -> None:
    problem = md.load(FOUR_BAR)
    short = problem.with_task("turn", replace(problem.tasks["turn"], poses=19))  # type: ignore[call-arg]
    ranking = md.rank(short, by="pairs", criteria=["width", "lengths"])
    why = {row.name: row.why for row in ranking.rows}
    assert len(why) == 16
    assert "opens at joint C" in why["pairs-RPRR"]
    assert "pairs-RPRR" not in ranking.order
    assert why["pairs-RRRR"] == ""


def test_variants_without_the_load_are_not_compared() -> None:
    every = md.variants("quick-return-friction", "pairs")
    found = [own for own in every if own.name in ("pairs-RRPR", "pairs-RRPP")]
    ranking = md.rank("quick-return-friction", variants=found)
    why = {row.name: row.why for row in ranking.rows}
    assert "no load 'load'" in why["pairs-RRPP"]
    assert why["pairs-RRPR"] == ""


def test_folder_and_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder, out = str(tmp_path / "orders"), tmp_path / "ranking"
    assert main(["variants", FOUR_BAR, "--by", "order", "--out", folder]) == 0
    (tmp_path / "orders" / "broken.toml").write_text("schema = 1\n[bodies", encoding="utf-8")
    words = ["rank", FOUR_BAR, "--variants", folder]
    asked = ["--weights", "width=0.6", "height=0.4", "--json", "--out", str(out)]
    assert main([*words, *asked]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data.keys() >= {"criteria", "rows", "order", "intervals"}
    broken = next(row for row in data["rows"] if row["name"] == "broken")
    assert "not valid TOML" in broken["why"]
    assert len(data["order"]) == 3
    sums = {}
    columns = {
        name: [row["values"].get(name) for row in data["rows"]] for name in ("width", "height")
    }
    for row in data["rows"]:
        if row["name"] in data["order"]:
            sums[row["name"]] = 0.0
            for name, weight in (("width", 0.6), ("height", 0.4)):
                known = [own for own in columns[name] if own is not None]
                share = (row["values"][name] - min(known)) / (max(known) - min(known))
                sums[row["name"]] += weight * share
    assert data["order"] == sorted(sums, key=sums.__getitem__)
    low, high = data["intervals"]["width"]
    assert low <= 0.6 <= high
    assert {own.name for own in out.iterdir()} >= {
        "ranking.csv", "ranking.json", "parallel.svg", "front.svg", "sheet.svg",
        "order-crank-rocker-coupler.toml",
    }  # fmt: skip
    for bad, said in (
        (["--weights", "width=0.6", "height=0.6"], "add up to 1.2"),
        (["--weights", "wide=1"], "did you mean width"),
        (["--weights", "width"], "not NAME=NUMBER"),
        (["--within", "depht=1"], "unknown criterion"),
        (["--by", "order"], "not together"),
    ):
        assert main([*words, *bad]) == 2
        assert said in capsys.readouterr().err
    assert main(["rank", FOUR_BAR, "--variants", str(tmp_path / "none")]) == 2
    assert "no such folder" in capsys.readouterr().err
    assert main([*words, "--within", "width_mm=10"]) == 1
    assert "no variant is left" in capsys.readouterr().err


def test_pictures_of_constructions() -> None:
    ranking = md.rank(FOUR_BAR, variants=md.variants(FOUR_BAR, "construction", limit=40))
    best = pictures.sheet(ranking, dict.fromkeys(ranking.order[:4]))
    assert len(best.axes) == 4
    lines = pictures.parallel(ranking).axes[0].get_lines()
    assert len(lines) == len(ranking.order) + 2  # layers and depth differ
    assert pictures.fronts(ranking).axes[0].get_xlabel().startswith("layers")


def test_wear_is_that_of_the_worst_contact() -> None:
    problem = md.load("slider-crank-inertia")
    joints = {
        name: replace(joint, face_width=0.03, **({"contact_length": 0.08} if joint.guide else {}))
        for name, joint in problem.mechanism.joints.items()
    }
    problem = replace(problem, mechanism=replace(problem.mechanism, joints=joints))
    words = ("peak_pressure", "peak_pv", "mean_pv", "sliding_distance")
    ranking = md.rank(problem, by="inversion", criteria=words)
    assert len(ranking.order) == 4
    for row in ranking.rows:
        wear = md.solve(ranking.variants[row.name].problem, "cycle").summary["wear"]
        worst = {word: max(contact[word] for contact in wear.values()) for word in words}
        assert row.values == worst
    assert [criterion["unit"] for criterion in ranking.criteria] == ["Pa", "W/m2", "W/m2", "m"]
