"""Certificates: what is written stands the check, what was altered does not."""

from __future__ import annotations

import functools
import json
import random
import statistics
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.errors import InputError, SolveError, UnavailableError
from tests.shared.altered import KINDS, alter
from tests.shared.certified import certificate, checked, refusal
from tests.shared.command import run
from tests.shared.paths import ROOT

pytest.importorskip("flint", reason="python-flint is not installed")
from mechdae.parts.proof.checker import PlanarMechanism, mechanism_of
from mechdae.parts.proof.checker.arithmetic import exact
from mechdae.parts.proof.checker.theorems_in_plane import most_in_plane
from mechdae.parts.proof.in_balls import left_out
from mechdae.parts.proof.write import certificate_of

MODES = {
    **{"modes": (4, 8), "platform": (6, 6), "geared": (4, 4), "tip": (4, 4)},
    **{"spatial modes": (2, 2), "spatial vectors": (4, 4), "planetary-gear-train": (1, 1)},
    **{"rack-and-pinion": (2, 2), "bevel-differential": (1, 1), "rssp": (2, 2)},
    **{"spatial-slider-crank-loops": (2, 2)},
}
"""Real and complex poses: dyads 2 each; platforms 6; a dyad with a gear of a + 1 and a = 1 turns 4;
a pin that is driven and a dyad 2 x 2; a turn that a cross holds 2; two circles and a line 4; wheels
on pins 1; a slider-crank 2, wheel and rack follow; bevel wheels 1; a sphere and a line 2; a circle
and a line 2."""
PATHS = {
    **{"limits": 7, "branches": 1, "gears": 5, "slides": 5, "laws": 3, "linear": 3, "rest": 5},
    **{"space": 2, "legs": 3, "spinning": 3},
}
"""Poses of tasks, all of them on the path."""
ALTERED = {
    "limits": ("limit", "pose", "step", "bound"),
    "slides": ("number", "order", "joint", "body", "law"),
    "laws": ("number", "law", "bound"),
    "geared": ("number", "label", "mode", "complex", "joint", "body", "bound", "law"),
    "spatial modes": ("mode", "complex", "number"),
    "spatial vectors": ("mode", "complex", "number"),
    "space": ("step", "body", "bound", "law"),
}
"""Each kind once at least; `tests.scripts.certificates` plants hundreds."""


@pytest.mark.parametrize("word", PATHS)
def test_paths_are_checked(word: str, tmp_path: Path) -> None:
    assert f" {PATHS[word]} poses" in checked(certificate(word), tmp_path)


@pytest.mark.parametrize("word", MODES)
def test_modes_are_checked(word: str, tmp_path: Path) -> None:
    proved = checked(certificate(word), tmp_path)
    assert proved.startswith("{} modes, and no others: of {} complex".format(*MODES[word]))


def test_superfluous_equations_are_left_out_for_a_whole_turn(tmp_path: Path) -> None:
    """Of Schatz' linkage what others tell in the middle of the turn is needed elsewhere."""
    problem = md.load("schatz")
    content = certificate_of(
        problem.with_task("turn", replace(problem.tasks["turn"], poses=5)), "turn"
    )
    path = content["path"]
    places = [path, *path["steps"]][::2]
    worst = max(condition(content["mechanism"], place) for place in places)
    middle = path["steps"][len(path["steps"]) // 2]
    alone = left_out(content["mechanism"], [(middle["bodies"], middle["to"])])
    assert alone != content["mechanism"]["superfluous"]
    other = content["mechanism"] | {"superfluous": alone}
    assert max(condition(other, place) for place in places) > 10 * worst
    path["steps"], content["poses"] = path["steps"][:1], content["poses"][:1]
    proved = checked(content, tmp_path)
    assert " 1 poses, of others nothing is claimed, 1 redundant equations off by" in proved
    assert " steps, 0 limit positions, " in proved


def condition(mechanism: dict[str, Any], place: Any) -> float:
    """Return the condition number of the equations that are kept at a place of a path."""
    m = mechanism_of(mechanism)
    z = m.claimed(place, exact(place.get("to", place.get("at")), ""), "")
    return float(np.linalg.cond([[float(v) for v in row] for row in m.dense(z, m.n)]))


def test_altered_certificates_are_refused(tmp_path: Path) -> None:
    """A number by 1e-6, a step or a mode left out, ...: refused, and it is said where."""
    rng, seen = random.Random(5), set[str]()
    for word, kinds in ALTERED.items():
        for kind in kinds:
            other, what = alter(certificate(word), kind, rng)
            if what:
                seen.add(kind)
                assert refusal(other, tmp_path), (word, kind, what)
    assert seen == set(KINDS)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        '{"certificate": 1, "kind": "sweep"}',
        '{"certificate": 2, "kind": "sweep"}',
        '{"certificate": 2, "kind": "sweep", "kind": "modes"}',
        '{"certificate": 2, "kind": "hope", "mechanism": {}}',
        '{"certificate": 2, "kind": "sweep", "mechanism": {"bodies": {}, "joints": {}}}',
        "[" * 100_000,
        '{"certificate": 2, "kind": "sweep", "mechanism": NaN}',
        "\xff\xfe",
    ],
)
def test_what_is_no_certificate_is_refused(text: str, tmp_path: Path, capsys: Any) -> None:
    path = tmp_path / "c.json"
    path.write_bytes(text.encode("latin-1"))
    code, out, err = run(capsys, "certify", "--check", str(path))
    assert (code, out) == (1, "")
    assert "refused" in err


def test_numbers_that_are_none_are_refused_with_their_place(tmp_path: Path) -> None:
    for bad in (1.5, "1e5", "1/0", "nan", "9" * 2000, None, ["1"], "١"):
        content = certificate("branches")
        content["mechanism"]["bodies"]["crank"]["A"][0] = bad
        assert "mechanism/bodies/crank/A/0" in refusal(content, tmp_path)


def test_long_files_are_not_read(tmp_path: Path, monkeypatch: Any) -> None:
    from mechdae.parts.proof.checker import arithmetic

    monkeypatch.setattr(arithmetic, "MOST_BYTES", 1000)
    assert "longer than 1000 bytes" in refusal(certificate("branches"), tmp_path)


def test_bounds_that_are_too_small_are_refused(tmp_path: Path) -> None:
    """Bounds a hundred times as small are smaller than some error."""
    content = certificate("branches")
    content["poses"][0]["bound"] = dict.fromkeys(("length", "angle"), f"1/{10**19}")
    assert "further off than its bound" in refusal(content, tmp_path)


def test_from_the_command_line(capsys: Any, tmp_path: Path) -> None:
    path = str(tmp_path / "pose.json")
    code, out, err = run(capsys, "certify", "gorshkov-seven-link", "--task", "pose", "--out", path)
    assert (code, out.strip()) == (0, path)
    code, out, err = run(capsys, "certify", "--check", path)
    assert code == 0
    assert "proved" in out
    code, out, err = run(capsys, "certify", "gorshkov-seven-link", "--check", path)
    assert code == 0
    changed = ("--set", "OA=0.1717")
    code, out, err = run(capsys, "certify", "gorshkov-seven-link", *changed, "--check", path)
    assert code == 1
    assert "mechanism/bodies/" in err
    code, out, err = run(capsys, "certify", "four-bar-crank-rocker", "--check", path)
    assert code == 2
    assert "another problem" in err
    for words in ((), ("gorshkov-seven-link",), ("--check", path, "--out", path)):
        assert run(capsys, "certify", *words)[0] == 2
    assert run(capsys, "certify", "gorshkov-seven-link", "--out", str(tmp_path))[0] == 2
    assert [entry.name for entry in tmp_path.iterdir()] == ["pose.json"]


@pytest.mark.parametrize(
    ("name", "task", "says"),
    [
        ("slider-crank-friction", "cycle", "reactions"),
    ],
)
def test_what_has_no_certificate_is_refused_by_name(name: str, task: str, says: str) -> None:
    with pytest.raises(UnavailableError, match=says):
        md.certify(name, task)
    assert issubclass(UnavailableError, InputError)


def test_what_spins_freely_is_refused_by_name() -> None:
    problem = md.load(ROOT / "tests/data/spatial/cylinder-between-two-balls.toml")
    modes = md.Modes(driver=md.Driver("cyl.slide", at=[0.1]))
    with pytest.raises(UnavailableError, match="modes is written where bodies spin freely"):
        certificate_of(problem.with_task("modes", modes), "modes")
    cyl = md.Cylindrical("cyl", "tube.M", "rod.M", axis=[0.7, -0.1, 0.7])
    joints = [cyl if j.name == "cyl" else j for j in problem.mechanism.joints.values()]
    sleeve = replace(problem, mechanism=replace(problem.mechanism, joints=joints))
    with pytest.raises(
        UnavailableError, match="freely about the line of their ball joints, which cyl"
    ):
        certificate_of(sleeve, "move")


def test_poses_next_to_a_limit_position_make_no_certificate_fail() -> None:
    """Those that the steps do not reach are left out, the others are checked."""
    problem = md.load("four-bar-double-rocker")
    low, high = md.solve(problem, "window").summary["limits"]
    at = (0.5 * (low + high), high - 1e-7, high + 0.1)
    task = replace(problem.tasks["window"], driver=md.Driver("left.angle", at=at), poses=None)
    found = md.certify(problem.with_task("near", task), "near")
    assert md.solve(problem.with_task("near", task), "near").status.tolist()[1] == "ok"
    assert [pose["pose"] for pose in found["poses"]] == [0, 2]


def test_without_balls_it_is_said_what_to_install(tmp_path: Path) -> None:
    """In a process of its own, where python-flint cannot be imported."""
    code = "import sys; sys.modules['flint'] = None; from mechdae.cli import main; "
    for words in (["certify", "slider-crank", "--out", "c.json"], ["certify", "--check", "c.json"]):
        call = [sys.executable, "-c", f"{code}sys.exit(main({words}))"]
        done = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 2, done.stderr
        assert 'pip install "mechdae[proof]"' in done.stderr
        assert "Traceback" not in done.stderr
    assert not list(tmp_path.iterdir())


def test_page_tells_what_was_measured() -> None:
    found = json.loads((ROOT / "docs" / "data" / "certificates.json").read_text())
    page = (ROOT / "docs" / "theory/evidence/certificates.md").read_text(encoding="utf-8")
    assert found["alterations"]["passed"] == []
    (refused,) = found["refused"]
    assert (refused["problem"], refused["task"]) == ("five-rod-suspension", "modes")
    assert "The count of `five-rod-suspension`, task `modes`, is not proven" in page
    assert found["alterations_of_modes"] == {"count": 66, "passed": []}
    assert found["written"] == sum("proved" in row for row in found["rows"])
    for text in (
        f"Of {found['tasks']} sweeps and tasks of modes {found['written']} have a certificate",
        f"of {found['alterations']['count']} alterations all are refused",
        f"{found['seconds_sweeps']:.1f} s to solve them",
        f"{found['seconds_checked']:.0f} s to check them",
    ):
        assert text in page


def test_page_tells_what_was_measured_in_space() -> None:
    found = json.loads((ROOT / "docs" / "data" / "certificates.json").read_text())
    page = (ROOT / "docs" / "theory/evidence/certificates.md").read_text(encoding="utf-8")
    (line,) = (line for line in page.splitlines() if line.startswith("Of spatial problems `"))
    names = line.split("`")[1::2]
    assert all(md.load(name).mechanism.dimension == 3 for name in names)
    rows = [row for row in found["rows"] if row["problem"] in names]
    written = [row for row in rows if "proved" in row]
    assert f"{len(written)} of {len(rows)} tasks have a certificate" in line
    times = [sum(row[word] for row in written) for word in ("solve", "write", "check")]
    assert "{:.1f} s to solve them, {:.1f} s to write, {:.1f} s to check".format(*times) in line
    count, passed = found["alterations_in_space"]["count"], found["alterations_in_space"]["passed"]
    assert all("/label" in what for what in passed)
    assert f"Of {count} alterations planted" in page
    assert f"{count - len(passed)} are refused with their place" in page


def test_page_tells_what_solving_costs_without_certificates() -> None:
    found = json.loads((ROOT / "docs" / "data" / "without-certify.json").read_text())
    page = (ROOT / "docs" / "theory/evidence/certificates.md").read_text(encoding="utf-8")
    rows = found["rows"]
    problems = len({row["problem"] for row in rows})
    assert f"compares {len(rows)} tasks of {problems} problems" in page
    for word, text in (("warm", "warm calls"), ("solve", "`md.solve`"), ("command", "commands")):
        told = statistics.median(row[word]["ratio"] for row in rows)
        assert found["median"][word] == round(told, 3)
        assert f"{found['median'][word]} for {text}" in page
        assert 0.95 < found["median"][word] < 1.05


@pytest.mark.parametrize(
    "law",
    [
        "t",
        ["-", "s", "1"],
        ["sin"],
        ["/", "1", "0"],
        ["*", "s"],
        [],
        None,
        1,
        ["cos", ["s"]],
        {"s": 1},
        functools.reduce(lambda law, _: ["sin", law], range(600), "s"),
    ],
    ids=lambda law: str(law)[:20],
)
def test_laws_that_are_none_are_refused(law: Any, tmp_path: Path) -> None:
    """Operations that are not known, too few of their values, division by zero, nested ones."""
    content = certificate("laws")
    content["mechanism"]["drivers"]["link.P.x"] = law
    refusal(content, tmp_path)


def test_formulas_have_no_value_that_is_not_read(tmp_path: Path) -> None:
    content = certificate("laws")
    name, law = next(iter(content["mechanism"]["drivers"].items()))
    assert isinstance(law, list)
    content["mechanism"]["drivers"][name] = [*law, "1"]
    assert "no formula" in refusal(content, tmp_path)


def test_files_that_are_cut_off_are_refused(tmp_path: Path) -> None:
    text, path = json.dumps(certificate("geared")), tmp_path / "c.json"
    for share in (0.1, 0.5, 0.99, 0.9999):
        path.write_text(text[: int(share * len(text))])
        with pytest.raises(SolveError, match="cut off"):
            md.check_certificate(path)


def test_a_bound_that_is_zero_is_refused(tmp_path: Path) -> None:
    """No pose is reported to the last bit of the exact one."""
    for word, part in (("laws", "poses"), ("platform", "modes")):
        content = certificate(word)
        content[part][1]["bound"] = dict.fromkeys(content[part][1]["bound"], "0")
        why = refusal(content, tmp_path)
        assert f"{part}/1/" in why
        assert "further off than its bound" in why


def test_theorems_ask_for_what_they_say() -> None:
    """Groups that are like those of a theorem have no count: a wheel that turns by 7/3 of its arm,
    a rack on the body that moves, a crank of which one coordinate of a point is driven."""

    def counted(joints: dict[str, Any], driver: str, group: list[str], **places: Any) -> int:
        names = {end.split(".")[0] for joint in joints.values() for end in joint["ends"]}
        m = object.__new__(PlanarMechanism)
        m.bodies, m.drivers = sorted(names - {"ground", *group}), dict.fromkeys(driver.split(), "s")
        made = {}
        for name, own in joints.items():
            ends = [tuple(end.split(".")) for end in own["ends"]]
            ratio = exact(own.get("ratio", "1"), name)
            carrier = own.get("carrier", "ground")
            made[name] = {"kind": own["kind"], "ends": ends, "carrier": carrier, "ratio": ratio}
            made[name]["bodies"] = [body for body, _ in ends]
        m.joints, m.counted, m.points = made, made, {}
        for end in (end for own in made.values() for end in own["ends"]):
            place = [exact(v, "") for v in places.get(".".join(end), ("0", "0"))]
            m.points.setdefault(end[0], {})[end[1]] = place
        return most_in_plane(m, group, {"ground", *m.bodies})[0]

    def pin(one: str, other: str) -> dict[str, Any]:
        return {"kind": "revolute", "ends": [one, other]}

    geared = {
        "mesh": {"kind": "gear", "ends": ["w.O", "b.B"], "carrier": "a", "ratio": "-1"},
        "A": pin("ground.A", "a.A"),
        "B": pin("a.B", "b.B"),
        "C": pin("b.C", "c.C"),
        "D": pin("ground.D", "c.D"),
    }
    assert counted(geared, "w.angle", ["a", "b", "c"]) == 4  # turns 1 and 2 of the arm
    assert (
        counted(geared | {"mesh": geared["mesh"] | {"ratio": "1/4"}}, "w.angle", ["a", "b", "c"])
        == 8
    )
    rack = {"R": {"kind": "rack", "ends": ["p.C", "w.F"]}, "P": pin("w.C", "p.C")}
    assert counted(rack, "w.angle", ["p"]) == 1
    beside = {"R": {"kind": "rack", "ends": ["p.D", "w.F"]}, "P": pin("w.C", "p.C")}
    assert counted(beside, "w.angle", ["p"]) == 1  # two names of one point
    assert counted(beside, "w.angle", ["p"], **{"p.D": ("1/8", "0")}) == 0  # an eccentric wheel
    crank = {"A": pin("ground.A", "a.A")}
    assert counted(crank, "a.angle", ["a"]) == counted(crank, "A.angle", ["a"]) == 1
    turned = {"R": {"kind": "rack", "ends": ["w.F", "p.C"]}, "P": pin("w.C", "p.C")}
    odd = geared | {"mesh": geared["mesh"] | {"ratio": "-3/4"}}
    for joints, driver, group in (
        (odd, "w.angle", ["a", "b", "c"]),
        (turned, "w.angle", ["p"]),
        (crank, "a.P.x", ["a"]),
    ):
        assert counted(joints, driver, group) == 0

    links = {key: joint for key, joint in geared.items() if key != "mesh"}
    dyad = {key: links[key] for key in "AB"}
    slide = links | {"B": {"kind": "prismatic", "ends": ["a.B", "b.B"]}}
    rod = crank | {"L": {"kind": "distance", "ends": ["ground.L", "a.L"]}}
    guides = {"A": {"kind": "prismatic", "ends": ["ground.A", "a.A"]}}
    cross = guides | {"B": pin("a.B", "b.B"), "C": guides["A"] | {"ends": ["ground.C", "b.C"]}}
    for joints, driver, group, count in (
        (links, "b.P.y", ["a", "b", "c"], 6),  # a coupler curve and a line (Roberts 1875)
        (slide, "B.slide", ["a", "b", "c"], 2),  # a dyad with one link of a given length
        (slide, "b.P.y", ["a", "b", "c"], 0),  # no coupler curve of four pins
        (dyad, "b.P.x b.P.y", ["a", "b"], 2),  # two circles
        (rod, "", ["a"], 2),  # two circles
        (cross, "", ["a", "b"], 1),  # two lines
        (cross | {"C": pin("ground.C", "b.C")}, "", ["a", "b"], 2),  # a line and a circle
        (links, "", ["a", "b", "c"], 0),  # it moves
    ):
        assert counted(joints, driver, group) == count, (driver, count)
