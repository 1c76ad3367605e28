"""The command line as a stranger uses it: outputs, exit codes, bad input."""

from __future__ import annotations

import csv
import json
import os
import sys
import tomllib

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.cli.commands.list import scanned
from mechdae.describe.file import library
from mechdae.errors import UnavailableError
from tests.shared.command import run


def test_list(capsys) -> None:
    code, out, err = run(capsys, "list")
    assert (code, err) == (0, "")
    assert "gorshkov-seven-link" in out
    code, out, _ = run(capsys, "list", "--json")
    entries = json.loads(out)
    assert [entry["name"] for entry in entries] == library.names()
    assert all(set(entry) == {"name", "kinds", "title"} for entry in entries)
    for path, entry in zip(library.paths(), entries, strict=True):
        data = tomllib.loads(path.read_text(encoding="utf-8"))
        kinds = {task["kind"] for task in data["tasks"].values()}
        assert entry == {"name": path.stem, "kinds": sorted(kinds), "title": data["title"]}


@pytest.mark.parametrize(
    "text",
    [
        'title = "a \\"b\\""\n[tasks.one]\nkind = "sweep"\n',
        '[tasks]\none = { kind = "sweep" }\n[bodies.a]\nkind = "x"\n',
        'title = "a"\ntasks.one.kind = "modes"\n',
        'title = "a"\n[tasks.one]\n[tasks.one.goal]\nkind = "path"\n',
        'title = "a"\n[tasks.one]\nat = """\n[tasks.two]\nkind = "sweep"\n"""\nkind = "modes"\n',
        'title = "a"\n[ tasks . one ]\nkind = "modes"\n',
        "title = 'a'\n[tasks.one]\n  kind = 'modes'\n",
    ],
)
def test_list_reads_what_a_parser_reads(tmp_path, text: str) -> None:
    path = tmp_path / "own.toml"
    path.write_text(text, encoding="utf-8")
    data = tomllib.loads(text)
    kinds = sorted({str(task.get("kind", "")) for task in data["tasks"].values()})
    assert scanned(path) == {"name": "own", "kinds": kinds, "title": data.get("title", "")}


def test_show(capsys) -> None:
    code, out, _ = run(capsys, "show", "gorshkov-seven-link")
    assert code == 0
    assert "I(1) -> II.3 RPR(2,3) -> {II.2 RRP(4,5); II.1 RRR(6,7)}" in out
    assert "W = 3*7 - 2*10 - 0 = 1" in out
    assert "not in the scene: coupler, rocker" in out
    code, out, _ = run(capsys, "show", "geared-five-bar", "--json")
    group = json.loads(out)["groups"][1]
    assert group["class"] == "III"
    assert group["higher_pairs"] == 1
    assert {"bodies", "joints", "class", "order", "kind", "after", "higher_pairs"} <= set(group)


def test_check(capsys, tmp_path) -> None:
    code, out, _ = run(capsys, "check", "slider-crank", "scotch-yoke")
    assert code == 0
    assert out.count("expected values met") == 2
    text = library.find("slider-crank").read_text().replace("value = 2\n", "value = 3\n")
    path = tmp_path / "wrong.toml"
    path.write_text(text)
    code, out, _ = run(capsys, "check", str(path))
    assert code == 1
    assert "deviation 1" in out
    path.write_text("schema = 1")
    assert run(capsys, "check", str(path), "slider-crank")[0] == 2


def test_solve_prints_a_table_that_fits(capsys) -> None:
    code, out, err = run(capsys, "solve", "gorshkov-seven-link")
    assert code == 0
    assert err == ""
    assert "-76.2758435725 deg .. 60.8807861275 deg" in out
    assert "not in the scene, not checked: coupler, rocker" in out
    assert "4 assembly mode(s), proven" in out
    table = [line for line in out.splitlines() if " ok " in line]
    assert max(len(line) for line in table) <= 100


def test_solve_json_is_one_object(capsys) -> None:
    code, out, _ = run(capsys, "solve", "gorshkov-seven-link", "--json")
    assert code == 0
    data = json.loads(out)
    assert data["mechdae"] == md.__version__
    assert set(data["tasks"]) == {"pose", "window", "turn", "modes"}
    pose = data["tasks"]["pose"]
    assert pose["points"]["rod.B"]["velocity"][0] == pytest.approx(
        [0.7384832042519739, -0.1737443748209195], rel=1e-12
    )
    assert pose["joints"]["slot"]["slide"][0] == pytest.approx(0.5895, rel=1e-12)
    window = data["tasks"]["window"]
    assert window["bodies"]["coupler"]["angular_velocity"][0] is None
    assert window["condition"][0] is None
    assert window["status"][0] == "limit"
    assert data["tasks"]["modes"]["labels"] == [list(x) for x in ("+++", "++-", "+-+", "+--")]
    assert "reaction" not in pose["joints"]["slot"]


def test_solve_writes_files_with_units(capsys, tmp_path) -> None:
    words = ("solve", "slider-crank", "--task", "turn", "--poses", "7", "--out", str(tmp_path))
    code, _, err = run(capsys, *words)
    assert code == 0
    assert err.count("written") == 3
    assert run(capsys, *words, "--quiet")[2] == ""
    rows = list(csv.reader((tmp_path / "turn.csv").read_text().splitlines()))
    assert rows[0][0] == "status"
    assert "slider.C.velocity.x [m/s]" in rows[0]
    assert "guide.slide_acceleration [m/s2]" in rows[0]
    assert len(rows) == 8
    with np.load(tmp_path / "turn.npz") as archive:
        packed = dict(archive)
    column = rows[0].index("guide.slide [m]")
    assert float(rows[3][column]) == packed["guide.slide"][2]
    data = json.loads((tmp_path / "turn.json").read_text())
    assert data["tasks"]["turn"]["joints"]["guide"]["slide"][2] == packed["guide.slide"][2]
    names = ["turn.csv", "turn.json", "turn.npz", "turn.result.npz"]
    assert sorted(path.name for path in tmp_path.iterdir()) == names


def test_set_mode_and_poses(capsys) -> None:
    def angle(*words: str) -> float:
        code, out, _ = run(
            capsys, "solve", "gorshkov-seven-link", "--task", "pose", "--json", *words
        )
        assert code == 0
        return json.loads(out)["tasks"]["pose"]["bodies"]["rocker"]["angle"][0]

    assert angle("--set", "phi1_deg=40") == angle("--set", "phi1=40*pi/180")
    assert angle() != angle("--mode", "+,+,+")
    _code, out, _ = run(capsys, "solve", "slider-crank", "--task", "turn", "--poses", "5", "--json")
    assert len(json.loads(out)["tasks"]["turn"]["status"]) == 5


def test_a_pose_that_does_not_assemble_is_one(capsys, tmp_path) -> None:
    code, out, err = run(
        capsys,
        "solve",
        "gorshkov-seven-link",
        "--task",
        "pose",
        "--set",
        "phi1_deg=70",
        "--json",
        "--out",
        str(tmp_path),
    )
    assert code == 1
    pose = json.loads(out)["tasks"]["pose"]
    assert pose["status"] == ["unassembled"]
    assert pose["points"]["slider.C"]["position"][0][0] > 0
    assert pose["points"]["coupler.E"]["position"] == [[None, None]]
    assert pose["bound"]["length"] == [None]
    assert pose["summary"]["failed"][0]["joint"] == "E"
    assert pose["summary"]["failed"][0]["group"] == ["coupler", "rocker"]
    assert "II.1 RRR(6,7) opens at joint E" in err
    assert "60.8808 deg" in err
    assert (tmp_path / "pose.csv").exists()


def test_a_mechanism_that_does_not_assemble_is_one(capsys) -> None:
    code, out, err = run(capsys, "solve", "gorshkov-seven-link", "--set", "BE=0.1", "--json")
    assert code == 1
    kinds = json.loads(out)["tasks"]
    assert set(kinds) == {"turn", "modes"}
    assert kinds["modes"]["summary"]["count"] == 0
    assert "joint E stays open" in err


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["bogus"], "invalid choice"),
        ([], "required"),
        (["solve"], "required"),
        (["solve", "slider-cranc"], "did you mean slider-crank"),
        (["solve", "nowhere"], "mechdae list"),
        (["solve", "none.toml"], "no such file"),
        (["solve", "slider-crank", "--task", "trun"], "did you mean turn"),
        (["solve", "slider-crank", "--set", "q=1"], "unknown parameter 'q'"),
        (["solve", "slider-crank", "--set", "r"], "NAME=VALUE"),
        (["solve", "slider-crank", "--set", "r=__import__('os')"], "unknown function"),
        (["solve", "slider-crank", "--set", "r=nan"], "finite"),
        (["solve", "slider-crank", "--poses", "0"], "above 0"),
        (["solve", "slider-crank", "--poses", "x"], "invalid int"),
        (["solve", "slider-crank", "--mode", "?"], "the modes here are"),
        (["solve", "slider-crank", "--mode", "-:1"], "the modes here are"),
        (["plot", "slider-crank", "--kind", "diagramm"], "did you mean diagram"),
        (["plot", "slider-crank", "--format", "bmp"], "format"),
        (["new", "fourbar"], "did you mean four-bar"),
        (["show", "slider-crank", "--frob"], "unrecognized"),
    ],
)
def test_bad_usage_is_two(capsys, words: list[str], text: str) -> None:
    code, out, err = run(capsys, *words)
    assert code == 2
    assert out == ""
    assert text in err


def test_out_that_cannot_be_written(capsys, tmp_path) -> None:
    file = tmp_path / "file"
    file.write_text("")
    code, _, err = run(capsys, "solve", "slider-crank", "--task", "turn", "--out", str(file))
    assert code == 2
    assert "file" in err


def test_tasks_of_a_kind_that_nobody_added_are_refused() -> None:
    from dataclasses import dataclass

    from mechdae.describe.tasks import kinds

    @dataclass(frozen=True)
    class Later(kinds.Task):
        """A kind of task that no registry names."""

        kind = "later"

    with pytest.raises(UnavailableError, match="'later' are not computed"):
        md.solve("slider-crank", Later())


def test_schema_and_new(capsys) -> None:
    code, out, _ = run(capsys, "schema")
    assert code == 0
    assert json.loads(out)["title"] == "mechdae problem file"
    code, out, _ = run(capsys, "new", "four-bar")
    assert code == 0
    assert out.startswith("#:schema mechdae.schema.json\nschema = 1\n")


def test_plot(capsys, tmp_path) -> None:
    words = ["plot", "gorshkov-seven-link", "--out", str(tmp_path)]
    code, out, _ = run(capsys, *words)
    assert code == 0
    assert out.strip().endswith("gorshkov-seven-link-pose-diagram.svg")
    code, out, _ = run(capsys, *words, "--task", "turn", "--format", "png")
    assert code == 0
    assert (tmp_path / "gorshkov-seven-link-turn-diagram.png").stat().st_size > 5000


def test_plot_of_a_study_is_refused(capsys, tmp_path) -> None:
    text = library.find("slider-crank").read_text()
    text += '\n[tasks.map]\nkind = "study"\nof = "turn"\nvary = { r = [0.1, 0.2, 3] }\n'
    path = tmp_path / "map.toml"
    path.write_text(text + 'outputs = ["summary/stroke/guide"]\n')
    code, out, err = run(
        capsys, "plot", str(path), "--task", "map", "--kind", "diagram", "--out", str(tmp_path)
    )
    assert (code, out) == (2, "")
    assert "a study has no pose to draw" in err
    assert "--task turn" in err


def test_bench_quick(capsys, tmp_path) -> None:
    code, out, _ = run(capsys, "bench", "slider-crank", "--quick", "--out", str(tmp_path))
    assert code == 0
    assert "yardstick" in out
    records = json.loads((tmp_path / "bench.json").read_text())
    for record in records:
        assert {"work", "n", "ratio", "yardstick", "error", "seconds"} <= set(record)
    assert len({record["run"] for record in records}) == 1
    for record in records:
        assert record["version"] == md.__version__
        assert record["back_end"]
        assert record["load"] is None or record["load"] >= 0
        assert record["date"].endswith("Z")
        assert record["error"] <= record["allowed"]
        assert record["error"] <= record["bound"]
        assert record["not_ok"] == 0
    ways = ["md.solve, first", "md.solve, again", "md.Solver", "md.Solver.poses"]
    assert [record["method"] for record in records] == 2 * ways
    assert (tmp_path / "bench.svg").stat().st_size > 5000


def test_debug_shows_the_traceback() -> None:
    with pytest.raises(md.UnknownName):
        main(["solve", "none", "--debug"])


def test_check_finds_what_solve_would_refuse(capsys, tmp_path) -> None:
    text = library.find("slider-crank").read_text().split("[[expected]]")[0]
    path = tmp_path / "mine.toml"
    path.write_text(text)
    code, out, _ = run(capsys, "check", str(path))
    assert (code, out.strip()) == (0, "mine: valid, no expected values")
    for old, new, words, expected in (
        ("rod_deg", "rodd_deg", "sketch.rodd", 2),
        ('"crank.angle"', '"slider.angle"', "redundant", 2),
        ("to_deg = 360", "to_deg = 0", "same value", 2),
        (
            "C     = {",
            'C2 = { kind = "revolute", between = ["rod.C", "slider.C"] }\nC     = {',
            "repeats joint C",
            2,
        ),
    ):
        assert old in text, old
        path.write_text(text.replace(old, new))
        code, _, err = run(capsys, "check", str(path))
        assert words in err
        assert code == expected
        assert run(capsys, "solve", str(path))[0] == expected


def test_names_a_student_would_type(capsys, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = library.find("slider-crank").read_text().split("[[expected]]")[0]
    (tmp_path / "mine.toml").write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert run(capsys, "solve", "mine.toml")[0] == 0
    assert "did you mean the file mine.toml" in run(capsys, "solve", "mine")[2]
    for old, new, words in (
        ('kind = "revolute"', 'kind = "hinge"', "did you mean revolute"),
        ('kind = "revolute"', 'kind = "revolut"', "did you mean revolute"),
        ('kind = "revolute"', 'kind = "xyz"', "one of revolute, prismatic"),
        ("[parameters]", "[parameters]\npi = 3", "reserved"),
    ):
        (tmp_path / "bad.toml").write_text(text.replace(old, new, 1))
        code, _, err = run(capsys, "solve", "bad.toml")
        assert code == 2
        assert words in err
        assert "bad.toml" in err
    code, _, err = run(capsys, "new", "four-bar", "--out", "bad.toml")
    assert (code, "exists already" in err) == (2, True)
    assert run(capsys, "new", "four-bar", "--out", "new.toml")[0] == 0
    assert run(capsys, "check", "new.toml")[0] == 0


@pytest.mark.parametrize("words", [[], ["--json"]])
def test_a_reader_that_goes_away_does_not_cost_the_files(tmp_path, monkeypatch, words) -> None:
    """``mechdae solve P --out DIR | head -1`` writes its files although nobody reads on."""
    reads, writes = os.pipe()
    os.close(reads)
    with open(writes, "w", buffering=1, encoding="utf-8") as unread:
        monkeypatch.setattr(sys, "stdout", unread)
        code = main(["solve", "toggle-four-bar", "--quiet", "--out", str(tmp_path / "o"), *words])
    assert code == 0
    assert {path.suffix for path in (tmp_path / "o").iterdir()} == {".csv", ".json", ".npz"}


@pytest.mark.parametrize("command", [["list"], ["show", "gorshkov-seven-link"], ["modules"]])
def test_a_terminal_gets_lines_of_its_width(command, capsys, monkeypatch):
    main(command)
    plain = capsys.readouterr().out
    assert max(map(len, plain.splitlines())) > 100
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    main(command)
    folded = capsys.readouterr().out
    assert max(map(len, folded.splitlines())) <= 80
    assert folded.split() == plain.split()
