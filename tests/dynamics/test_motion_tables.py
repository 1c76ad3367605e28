"""Tables over the time as loads and laws of a motion."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.describe.file.load import from_dict
from mechdae.equations.forces.time_tables import _spline

G = 9.81


def pushed(table: dict[str, Any], friction: float = 0.0, **task: Any) -> Any:
    """Return a block of 1 kg on a guide under a table of forces over the time."""
    guide: dict[str, Any] = {"kind": "prismatic", "between": ["ground.O", "a.P"]}
    guide |= {"friction": friction} if friction else {}
    return from_dict(
        {
            "schema": 1,
            "gravity": [0, -G],
            "parameters": {"late": 0.5},
            "ground": {"points": {"O": [0, 0]}},
            "bodies": {"a": {"points": {"P": [0, 0]}, "mass": 1.0}},
            "joints": {"G": guide},
            "loads": {"F": {"kind": "table", "coordinate": "t", "along": "G.slide", **table}},
            "tasks": {"m": {"kind": "motion", "until": 5.0, **task}},
        }
    )


def driven(table: dict[str, Any], **task: Any) -> dict[str, Any]:
    """Return a block of 1 kg whose slide follows a table."""
    return {
        "schema": 1,
        "parameters": {"late": 0.5},
        "ground": {"points": {"O": [0, 0]}},
        "bodies": {"a": {"points": {"P": [0, 0]}, "mass": 1.0}},
        "joints": {"G": {"kind": "prismatic", "between": ["ground.O", "a.P"]}},
        "tasks": {
            "m": {
                "kind": "motion",
                "until": 5.0,
                "drivers": [{"coordinate": "G.slide", "table": table}],
                **task,
            }
        },
    }


# -- loads ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("tolerance", [1e-4, 1e-12])
def test_straight_lines_are_exact(tolerance: float) -> None:
    """Rows are breakpoints: between them the motion is a cubic."""
    rows = [[0, 0], [1, 2], [3, -1], [5, 0]]
    result = md.solve(pushed({"rows": rows}, tolerance=tolerance), "m")
    t = [row[0] for row in rows]
    v = x = 0.0
    for (a, f), (b, g) in itertools.pairwise(rows):
        h = b - a
        x += v * h + f * h**2 / 2 + (g - f) * h**2 / 6
        v += (f + g) / 2 * h
    assert result.joints["G"].slide[-1] == pytest.approx(x, rel=1e-13)
    assert result.joints["G"].slide_velocity[-1] == pytest.approx(v, rel=1e-13)
    assert set(t) <= set(result.time.tolist())


def test_saw_teeth_with_shift_and_period() -> None:
    """A tooth of 1 s that jumps back; one that comes back straight over a period of 2 s."""
    saw = md.solve(pushed({"rows": [[0, 0], [1, 2]], "periodic": True}), "m")
    assert saw.joints["G"].slide_velocity[-1] == pytest.approx(5.0, rel=1e-13)
    slow = {"rows": [[0, 0], [1, 2]], "period": 2, "shift": "late"}
    # from 1.5 s of the table on: 1/4, two periods of 2 each, 1/4
    late = md.solve(pushed(slow), "m")
    assert late.joints["G"].slide_velocity[-1] == pytest.approx(4.5, rel=1e-13)
    assert late.fault is None


def test_a_spline_has_order_four() -> None:
    """Against 1 - cos(5) for sin(t), period 2 pi; halving the rows divides the error by 16."""
    errors = []
    for n in (20, 40, 80):
        t = np.linspace(0, 2 * math.pi, n + 1)
        rows = [[own, math.sin(own)] for own in t[:-1].tolist()]
        table = {"rows": rows, "period": 2 * math.pi, "interpolation": "spline"}
        result = md.solve(pushed(table), "m")
        errors.append(abs(result.joints["G"].slide_velocity[-1] - (1 - math.cos(5))))
    assert errors[0] < 1e-4
    assert errors[1] < errors[0] / 12
    assert errors[2] < errors[1] / 12


@pytest.mark.parametrize("n", [2, 3, 4, 5, 40])
def test_splines_that_do_not_close_keep_cubics(n: int) -> None:
    """Not a knot: polynomials of degree three, two and one come back as they are."""
    rng = np.random.default_rng(n)
    X = np.cumsum(rng.uniform(0.1, 1, n))
    terms = rng.uniform(-1, 1, min(n, 4))
    pieces = _spline(X, np.polyval(terms, X), False)
    for row, at in zip(pieces, X, strict=False):
        taylor = [np.polyval(np.polyder(terms, k), at) / math.factorial(k) for k in range(4)]
        assert row == pytest.approx(taylor, abs=1e-10)


@pytest.mark.parametrize("n", [3, 4, 5, 60])
def test_closed_splines_are_smooth(n: int) -> None:
    rng = np.random.default_rng(n)
    X = np.cumsum(rng.uniform(0.1, 1, n))
    Y = rng.uniform(-1, 1, n)
    Y[-1] = Y[0]
    pieces, h = _spline(X, Y, True), np.diff(X)
    for k in range(3):
        own = np.array([np.polyder(row[::-1], k) for row in pieces])
        ends = np.array([np.polyval(row, step) for row, step in zip(own, h, strict=True)])
        starts = own[:, -1]
        assert ends == pytest.approx(np.roll(starts, -1), abs=1e-10)


def test_a_stuck_block_under_a_table() -> None:
    """Lines to 4 N at 2 s and back; friction of 3 N: it slips at 1.5 s and stops."""
    result = md.solve(pushed({"rows": [[0, 0], [2, 4], [4, 0], [5, 0]]}, friction=3 / G), "m")
    slip, stick = [(e["kind"], e["at"]) for e in result.events]
    assert slip == ("slip", pytest.approx(1.5, abs=1e-12))
    # speed u^2 until 2 s, then 1/4 + u - u^2
    assert stick == ("stick", pytest.approx(2 + (1 + math.sqrt(2)) / 2, abs=1e-10))


def test_a_measured_force(tmp_path: Path) -> None:
    """Steps end at each of 1001 rows; folders are copied with their files."""
    t = np.linspace(0, 1, 1001)
    (tmp_path / "force.csv").write_text(
        "time,force\n" + "".join(f"{own!r},{math.sin(40 * own)!r}\n" for own in t.tolist())
    )
    problem = pushed({"rows": [[0, 0], [1, 1]]}, until=1.0)
    md.dump(problem, tmp_path / "block.toml")
    text = (tmp_path / "block.toml").read_text()
    text = text.replace("rows = [[0.0, 0.0], [1.0, 1.0]]", 'file = "force.csv"')
    (tmp_path / "block.toml").write_text(text)
    result = md.solve(md.load(tmp_path / "block.toml"), "m")
    # the trapezoidal rule of the same rows
    area = float(np.sum((np.sin(40 * t[1:]) + np.sin(40 * t[:-1])) / 2 * np.diff(t)))
    assert result.joints["G"].slide_velocity[-1] == pytest.approx(area, rel=1e-12)
    assert result.summary["rhs"] <= 40 * 1000
    other = tmp_path / "other"
    other.mkdir()
    md.dump(md.load(tmp_path / "block.toml"), other / "block.toml")
    assert md.solve(md.load(other / "block.toml"), "m").time[-1] == 1.0


def test_a_table_that_ends_before_the_motion() -> None:
    result = md.solve(pushed({"rows": [[0, 0], [1, 2]]}), "m")
    assert result.fault is not None
    assert "table of load F ends before the motion" in result.fault
    assert result.time[-1] == 1.0
    assert result.joints["G"].slide_velocity[-1] == pytest.approx(1.0, rel=1e-12)


def test_nothing_is_said_behind_the_end_of_a_table() -> None:
    """Random rows of forces and of laws: all states are within, those of forces by quadrature."""
    generator = np.random.default_rng(5)
    for k in range(12):
        t = np.append(0.0, np.cumsum(generator.uniform(0.2, 0.9, 4)))
        values = np.append(0.0, generator.normal(size=4))
        table = {"rows": np.stack([t, values], axis=1).tolist()}
        count = int(generator.integers(5, 40))
        forced = bool(k % 2)
        problem = pushed(table, poses=count) if forced else from_dict(driven(table, poses=count))
        result = md.solve(problem, "m")
        assert result.fault is not None
        assert "ends before the motion" in result.fault
        step = 5.0 / (count - 1)
        assert t[-1] - step - 1e-9 <= result.time[-1] <= t[-1] * (1 + 1e-12)
        assert (np.asarray(result.status) == "ok").all()
        if not forced:
            continue
        for own, speed in zip(result.time, result.joints["G"].slide_velocity, strict=True):
            inside = np.append(t[t < own], own)
            force = np.interp(inside, t, values)
            area = float(np.sum((force[1:] + force[:-1]) / 2 * np.diff(inside)))
            assert speed == pytest.approx(area, abs=1e-9)


# -- laws ----------------------------------------------------------------------------------------


def test_a_law_by_rows(tmp_path: Path) -> None:
    """sin(t) by 80 rows, half a second late: place, speed and the work of the driver."""
    t = np.linspace(-1, 6, 80)
    (tmp_path / "law.csv").write_text("".join(f"{own!r},{math.sin(own)!r}\n" for own in t.tolist()))
    rows = [[own, math.sin(own)] for own in t.tolist()]
    plain = from_dict(driven({"rows": rows, "shift": "late", "factor": 2}))
    md.dump(plain, tmp_path / "plain.toml")
    text = (tmp_path / "plain.toml").read_text()
    assert md.load(tmp_path / "plain.toml").tasks == plain.tasks
    start = text.index("rows = ")
    end = text.index("]]", start) + 2
    (tmp_path / "law.toml").write_text(text[:start] + 'file = "law.csv"' + text[end:])
    for problem in (plain, md.load(tmp_path / "law.toml")):
        result = md.solve(problem, "m")
        assert result.fault is None
        joint = result.joints["G"]
        assert joint.slide[-1] == pytest.approx(2 * math.sin(4.5), abs=2e-6)
        assert joint.slide_velocity[-1] == pytest.approx(2 * math.cos(4.5), abs=5e-5)
        speeds = joint.slide_velocity
        gained = (speeds[-1] ** 2 - speeds[0] ** 2) / 2
        assert result.work["drivers"][-1] == pytest.approx(gained, rel=1e-9)
    there = tmp_path / "copy"
    there.mkdir()
    md.dump(md.load(tmp_path / "law.toml"), there / "law.toml")
    assert (there / "law.csv").exists()


def test_a_periodic_law_turns_a_wheel() -> None:
    rows = [[own, math.sin(own)] for own in np.linspace(0, 2 * math.pi, 101)[:-1].tolist()]
    problem = from_dict(driven({"rows": rows, "period": 2 * math.pi}, until=20.0))
    result = md.solve(problem, "m")
    assert result.joints["G"].slide[-1] == pytest.approx(math.sin(20.0), abs=1e-6)
    assert result.checks["energy"] <= 1e-9


# -- mistakes ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"rows": [[0, 0]]}, "two rows"),
        ({"rows": [[0, 0], [0, 1]]}, "row 2"),
        ({"rows": [[0, 0], [1, 1]], "period": -1}, "period"),
        ({"rows": [[0, 0], [2, 1]], "period": 1}, "shorter than the table"),
        ({"rows": [[0, 0], [1, 1]], "period": 1, "periodic": True}, "not both"),
        ({"rows": [[0, 0], [1, 1]], "shift": "never"}, "shift.*never"),
        ({"rows": [[0, 0], [1, 1]], "interpolation": "cubic"}, "interpolation.*cubic"),
        ({"rows": [[0, 0], [1, 1]], "periodic": True, "interpolation": "spline"}, "begins at 0"),
    ],
)
def test_tables_that_mean_nothing(table: dict[str, Any], words: str) -> None:
    with pytest.raises(md.MechdaeError, match=words):
        md.solve(pushed(table), "m")


def test_keys_of_the_time_belong_to_tables_over_it() -> None:
    with pytest.raises(md.MechdaeError, match=r"shift.*table over t"):
        pushed({"coordinate": "G.slide", "rows": [[0, 0], [1, 1]], "shift": 1})


def test_laws_that_mean_nothing(tmp_path: Path, capsys: Any) -> None:
    lines = {"rows": [[0, 0], [1, 1], [2, 0]], "interpolation": "linear"}
    with pytest.raises(md.InputError, match=r"drivers\[0\].table.interpolation.*jump"):
        md.solve(from_dict(driven(lines)), "m")
    with pytest.raises(md.MechdaeError, match="row"):
        from_dict(driven({"row": [[0, 0], [1, 1]]}))
    both = driven({"rows": [[0, 0], [1, 1]]})
    both["tasks"]["m"]["drivers"][0]["law"] = "t"
    with pytest.raises(md.InputError, match="not both"):
        from_dict(both)
    sweep = driven({"rows": [[0, 0], [1, 1]]})
    sweep["tasks"]["m"] = {"kind": "sweep", "driver": sweep["tasks"]["m"]["drivers"][0]}
    with pytest.raises(md.InputError, match="drive motions"):
        from_dict(sweep)
    md.dump(from_dict(driven({"rows": [[0, 0], [1, 1]]})), tmp_path / "p.toml")
    text = (tmp_path / "p.toml").read_text()
    (tmp_path / "p.toml").write_text(
        text.replace("rows = [[0.0, 0.0], [1.0, 1.0]]", 'file = "absent.csv"')
    )
    assert main(["solve", str(tmp_path / "p.toml")]) == 2
    message = capsys.readouterr().err
    assert "drivers[0].table.file" in message
    assert "absent.csv" in message


# -- planted mistake -----------------------------------------------------------------------------


def test_without_breakpoints_straight_lines_are_not_exact(monkeypatch: pytest.MonkeyPatch) -> None:
    """The pieces stay those of the start if rows are no breakpoints."""
    from mechdae.equations.forces.time_tables import Timed

    monkeypatch.setattr(Timed, "knots", lambda *_: [])
    result = md.solve(pushed({"rows": [[0, 0], [1, 2], [3, -1], [5, 0]]}), "m")
    assert abs(result.joints["G"].slide_velocity[-1] - 1) > 0.1
