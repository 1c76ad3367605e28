"""Certificates: what is written stands the check, what was altered does not."""

from __future__ import annotations

import ast
import functools
import itertools
import json
import random
import statistics
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import mechdae as md
from mechdae.errors import InputError, SolveError, UnavailableError
from tests.shared.altered import KINDS, alter
from tests.shared.command import run
from tests.shared.paths import ROOT

pytest.importorskip("flint", reason="python-flint is not installed")
CASES = {
    "limits": ("four-bar-double-rocker", "window", 19),
    "branches": ("gorshkov-seven-link", "pose", None),
    "gears": ("planetary-gear-train", "turn", 13),
    "slides": ("scotch-yoke", "turn", 13),
    "laws": ("pantograph", "poses", None),
    "linear": ("differential", "line", 5),
    "rest": ("oscillating-cylinder", "start", 9),
    "modes": ("gorshkov-seven-link", "modes", None),
    "platform": ("triad-six-modes", "modes", None),
    "curve": ("double-watt", "modes", None),
    "geared": ("geared-five-bar", "modes", None),
    "tip": ("five-bar-robot", "postures", None),
    "space": ("rssr", "poses", None),
    "superfluous": ("cardan-joint", "poses", None),
    "legs": ("delta-robot", "path", None),
    "spatial modes": ("cardan-joint", "modes", None),
    "spatial vectors": ("vector-modules-spatial", "l_a_b", None),
}
MODES = {
    **{"modes": (4, 8), "platform": (6, 6), "curve": (6, 36), "geared": (4, 4), "tip": (4, 4)},
    **{"spatial modes": (2, 2), "spatial vectors": (4, 4)},
}
"""Real and complex poses: dyads 2 each; platforms 6; a coupler curve and a line 6, times a platform
6; a dyad with a gear of a + 1 and a = 1 turns 4; a pin that is driven and a dyad 2 x 2; a turn
that a cross holds 2; two circles and a line 4."""


@pytest.fixture(scope="module")
def written() -> dict[str, dict[str, Any]]:
    found = {}
    for word, (name, task, poses) in CASES.items():
        problem = md.load(name)
        if poses:
            own = problem.tasks[task]
            problem = problem.with_task(task, replace(own, poses=poses))
        found[word] = md.certify(problem, task)
    return found


@pytest.mark.parametrize("word", CASES)
def test_certificates_are_checked(word: str, written: Any, tmp_path: Path) -> None:
    path = tmp_path / "c.json"
    path.write_text(json.dumps(written[word]))
    proved = md.check_certificate(path)
    if word in MODES:
        assert proved.startswith("{} modes, and no others: of {} complex".format(*MODES[word]))
    elif CASES[word][2]:
        assert f" {CASES[word][2]} poses" in proved


def test_superfluous_equations_are_left_out_for_a_whole_turn(tmp_path: Path) -> None:
    """Of Schatz' linkage what others tell in the middle of the turn is needed elsewhere."""
    problem = md.load("schatz")
    problem = problem.with_task("turn", replace(problem.tasks["turn"], poses=5))
    path = tmp_path / "c.json"
    path.write_text(json.dumps(md.certify(problem, "turn")))
    told = md.check_certificate(path)
    assert " 5 poses, of others nothing is claimed, 1 superfluous equations off by" in told
    assert " steps, 0 limit positions, " in told


def test_altered_certificates_are_refused(written: Any, tmp_path: Path) -> None:
    """A number by 1e-6, a step or a mode left out, ...: refused, and it is said where."""
    rng, seen, path = random.Random(5), set(), tmp_path / "c.json"
    cases = [*itertools.product(("limits", "laws", "curve", "geared"), (*KINDS, "number"))]
    cases += itertools.product(("spatial modes", "spatial vectors"), ("mode", "complex", "number"))
    cases += [("space", kind) for kind in ("step", "body", "bound", "law")] + [("legs", "number")]
    for word, kind in cases:
        other, what = alter(written[word], kind, rng)
        if what:
            seen.add(kind)
            path.write_text(json.dumps(other))
            passes = f"{word}, {kind}, {what}"
            with pytest.raises(SolveError, match="refused") as refused:
                passes = md.check_certificate(path)
            assert refused.value.where, passes
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


def test_numbers_that_are_none_are_refused_with_their_place(written: Any, tmp_path: Path) -> None:
    path = tmp_path / "c.json"
    for bad in (1.5, "1e5", "1/0", "nan", "9" * 2000, None, ["1"], "١"):
        own = json.loads(json.dumps(written["branches"]))
        own["mechanism"]["bodies"]["crank"]["A"][0] = bad
        path.write_text(json.dumps(own))
        with pytest.raises(SolveError, match="mechanism/bodies/crank/A/0"):
            md.check_certificate(path)


def test_long_files_are_not_read(written: Any, tmp_path: Path, monkeypatch: Any) -> None:
    from mechdae.certificates import check

    monkeypatch.setattr(check, "MOST_BYTES", 1000)
    path = tmp_path / "c.json"
    path.write_text(json.dumps(written["branches"]))
    with pytest.raises(check.FalseClaim, match="longer than 1000 bytes"):
        check.check(str(path))


def test_bounds_that_are_too_small_are_refused(written: Any, tmp_path: Path) -> None:
    """Bounds a hundred times as small are smaller than some error."""
    own = json.loads(json.dumps(written["branches"]))
    own["poses"][0]["bound"] = {
        "length": "1/10000000000000000000",
        "angle": "1/10000000000000000000",
    }
    path = tmp_path / "c.json"
    path.write_text(json.dumps(own))
    with pytest.raises(SolveError, match="further off than its bound"):
        md.check_certificate(path)


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


OF_PATHS = ("check", "check_curves", "check_space")
"""Checkers that follow long ways in tubes around curves."""
BY_BOXES = ("check_space_turns", "check_space_places")
ON_CURVES = ("check_curves", "check_curve_modes")
CHECKERS = (
    *(*OF_PATHS, *BY_BOXES),
    *("check_modes", "check_space_modes", "check_crossings", "check_superfluous"),
    "check_curve_modes",
)


def source(name: str) -> str:
    return (ROOT / "mechdae" / "certificates" / f"{name}.py").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", CHECKERS)
def test_checkers_share_nothing_and_are_short(name: str) -> None:
    """They import flint and the standard library, and have at most 430 lines of code each."""
    text = source(name)
    tree, quoted = ast.parse(text), set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            assert {alias.name for alias in node.names} <= {"json", "re", "sys"}
        if isinstance(node, ast.ImportFrom):
            assert node.module in {"__future__", "collections.abc", "typing", "flint"}
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            quoted |= set(range(node.lineno, node.end_lineno + 1))
    lines = [
        line
        for k, line in enumerate(text.splitlines(), 1)
        if line.strip() and not line.strip().startswith("#") and k not in quoted
    ]
    assert len(lines) <= 430


def test_what_checkers_have_in_common_is_one_text() -> None:
    """Functions and classes of one name are the same to the letter, where space is no matter."""
    parts: dict[str, dict[str, str]] = {}
    for name in CHECKERS:
        text = source(name)
        found = parts.setdefault(name, {})
        for node in ast.parse(text).body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                found[node.name] = str(ast.get_source_segment(text, node))
    for one, other in itertools.combinations(CHECKERS, 2):
        apart = {
            "check",
            "compare",
            "sweep",
            "modes",
            "formula",
            "Checked",
            "most",
            "alike",
            "senses",
        }
        if ("space" in one) == ("space" in other):
            apart = {"check"} | ({"compare", "sweep", "modes"} if "space" not in one else set())
        if (one in ON_CURVES) != (other in ON_CURVES):
            apart |= {"formula", "Checked", "compare", "modes", "alike"}
        if (one in OF_PATHS) != (other in OF_PATHS):
            apart |= {"Tube", "solution", "follow", "term"}
        if (one in BY_BOXES) != (other in BY_BOXES):
            apart |= {"modes"}
        same = (parts[one].keys() & parts[other].keys()) - apart
        assert {"read", "exact", "part", "Dual"} <= same
        different = [key for key in same if parts[one][key] != parts[other][key]]
        assert not different, (one, other, different)
    assert {"Tube", "solution", "follow", "turning", "sweep"} <= parts["check"].keys()
    shared = parts["check_space_turns"].keys() & parts["check_space_places"].keys()
    assert {"Boxes", "Checked", "proved", "parted", "modes"} <= shared
    for name in OF_PATHS:
        assert parts["check"]["sweep"] == parts[name]["sweep"]


def test_poses_next_to_a_limit_position_make_no_certificate_fail(written: Any) -> None:
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
    page = (ROOT / "docs" / "certificates.md").read_text(encoding="utf-8")
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
    page = (ROOT / "docs" / "certificates.md").read_text(encoding="utf-8")
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
    page = (ROOT / "docs" / "certificates.md").read_text(encoding="utf-8")
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
def test_laws_that_are_none_are_refused(law: Any, written: Any, tmp_path: Path) -> None:
    """Operations that are not known, too few of their values, division by zero, nested ones."""
    own = json.loads(json.dumps(written["laws"]))
    own["mechanism"]["drivers"]["link.P.x"] = law
    path = tmp_path / "c.json"
    path.write_text(json.dumps(own))
    with pytest.raises(SolveError, match="refused"):
        md.check_certificate(path)


def test_files_that_are_cut_off_are_refused(written: Any, tmp_path: Path) -> None:
    text, path = json.dumps(written["geared"]), tmp_path / "c.json"
    for share in (0.1, 0.5, 0.99, 0.9999):
        path.write_text(text[: int(share * len(text))])
        with pytest.raises(SolveError, match="cut off"):
            md.check_certificate(path)


def test_a_bound_that_is_zero_is_refused(written: Any, tmp_path: Path) -> None:
    """No pose is reported to the last bit of the exact one."""
    path = tmp_path / "c.json"
    for word, part in (("laws", "poses"), ("curve", "modes")):
        own = json.loads(json.dumps(written[word]))
        own[part][1]["bound"] = dict.fromkeys(own[part][1]["bound"], "0")
        path.write_text(json.dumps(own))
        with pytest.raises(SolveError, match=f"{part}/1/.*further off than its bound"):
            md.check_certificate(path)


def test_theorems_ask_for_what_they_say() -> None:
    """Groups that are like those of a theorem have no count: a wheel that turns by 7/3 of its arm,
    a rack on the body that moves, a crank of which one coordinate of a point is driven."""
    from mechdae.certificates import check_modes as check

    def counted(joints: dict[str, Any], driver: str, group: list[str], **places: Any) -> int:
        names = {end.split(".")[0] for joint in joints.values() for end in joint["ends"]}
        m = object.__new__(check.Checked)
        m.bodies, m.drivers = sorted(names - {"ground", *group}), {driver: "s"}
        made = {}
        for name, own in joints.items():
            ends = [tuple(end.split(".")) for end in own["ends"]]
            ratio = check.exact(own.get("ratio", "1"), name)
            carrier = own.get("carrier", "ground")
            made[name] = {"kind": own["kind"], "ends": ends, "carrier": carrier, "ratio": ratio}
        m.joints, m.points = made, {}
        for end in (end for own in made.values() for end in own["ends"]):
            place = [check.exact(v, "") for v in places.get(".".join(end), ("0", "0"))]
            m.points.setdefault(end[0], {})[end[1]] = place
        return check.most(m, group, {"ground", *m.bodies})[0]

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
