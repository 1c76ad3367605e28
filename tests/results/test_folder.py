"""Results in folders: what is read back is what was computed, and nothing is computed again."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.tasks.export.folder import ENDING

CASES = (
    ("gorshkov-seven-link", "pose"),
    ("gorshkov-seven-link", "window"),  # limits, events
    ("gorshkov-seven-link", "modes"),
    ("geared-five-bar", "turns"),
    ("slider-crank-friction", "cycle"),
    ("four-stroke-engine", "cycle"),
    ("bennett", None),
)


def same(one: Any, other: Any) -> bool:
    """Whether two results are equal to the last bit, keys in the same order."""
    texts = [json.dumps(own.to_dict()) for own in (one, other)]
    return texts[0] == texts[1]


@pytest.mark.parametrize(("name", "task"), CASES)
def test_what_is_read_is_what_was_computed(name: str, task: str | None, tmp_path: Path) -> None:
    problem = md.load(name)
    chosen = task if task in problem.tasks else next(iter(problem.tasks))
    result = md.solve(problem, chosen)
    md.save(result, tmp_path)
    found = md.read(tmp_path)
    assert list(found) == [chosen]
    again = found[chosen]
    assert type(again) is type(result)
    assert same(again, result)
    assert str(again) == str(result)
    assert again.mechanism.values() == result.mechanism.values()
    assert again.definition == result.definition
    assert [type(event) for event in again.events] == [type(event) for event in result.events]
    for point, series in result.points.items():
        for word, array in series.items():
            assert again.points[point][word].tobytes() == np.asarray(array).tobytes()
    assert found.kind == result.kind  # of a single result the folder has its attributes


STUDY = {"vary": {"a": [0.03, 0.05, 4]}, "of": "turn", "outputs": ["summary/swing/rocker"]}


def test_studies_motions_sensitivities_and_equilibria(tmp_path: Path) -> None:
    study = md.study("four-bar-crank-rocker", **STUDY)
    asked = md.Sensitivity(of="turn", outputs=("summary/swing/rocker",), wrt=("a",))
    slope = md.solve("four-bar-crank-rocker", asked)
    results = [study, slope]
    problem = md.load("double-pendulum")
    task = next(own for own, task in problem.tasks.items() if task.kind == "equilibrium")
    motion = next(own for own, task in problem.tasks.items() if task.kind == "motion")
    results += [md.solve(problem, task), md.solve(problem, motion, set={"t_end": 0.1})]
    for k, result in enumerate(results):
        md.save(result, tmp_path / str(k))
        again = md.read(tmp_path / str(k))[result.task]
        assert same(again, result)
        assert again.definition == result.definition
        assert str(again) == str(result)


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("job")
    words = ["synthesize", "c2-arc5-timed", "--starts", "4", "--quiet", "--json"]
    assert main([*words, "--out", str(folder)]) == 0
    return folder


PLOTS = """
import sys
from mechdae.cli import main
for words in {calls}:
    assert main([*words, "--format", "png", "--out", sys.argv[1]]) == 0
assert "casadi" not in sys.modules, "something was solved"
"""


def test_pictures_of_folders_cost_no_solve(
    job: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without casadi no kernel, no motion and no NLP can be evaluated.

    Poses between those of the folder are solved only for curves that need them: 181 are enough.
    """
    words = ["solve", "slider-crank-friction", "--poses", "181", "--task", "cycle", "--quiet"]
    assert main([*words, "--out", str(tmp_path / "cycle")]) == 0
    calls = [["plot", str(tmp_path / "cycle"), *more] for more in (
        ["--kind", "diagram", "--pose", "3"], ["--kind", "plans", "--units", "mm"],
        ["--kind", "coupler"], ["--of", "bodies/rod/angle"],
    )]  # fmt: skip
    kinds = ("design", "compare", "census", "convergence")
    calls += [["plot", str(job), "--kind", kind] for kind in kinds]
    code = PLOTS.format(calls=repr(calls))
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "pictures")], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert len(list((tmp_path / "pictures").iterdir())) == len(calls)


def test_a_finished_job_is_read_with_its_designs(job: Path) -> None:
    found = md.read(job)
    data = json.loads((job / "design.json").read_text())["tasks"]["design"]
    assert found["design"].to_dict() == data
    design = found.data["designs"][0]
    motion = found.motions[design["problem"]]
    turn = md.solve(motion.problem, "path")
    assert same(motion.whole, turn)
    assert len(motion.smooth[0]) > len(turn)


# -- what is no result -----------------------------------------------------------------------


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    md.save(md.solve("gorshkov-seven-link", "pose"), tmp_path)
    return tmp_path


def refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> str:
    with pytest.raises(md.InputError) as caught:
        md.read(folder)
    assert main(["plot", str(folder)]) == 2
    text = capsys.readouterr().err
    assert str(caught.value).splitlines()[0] in text
    return text


@pytest.mark.parametrize("ending", ["json", "csv", "npz"])
def test_altered_and_missing_files_are_named(
    folder: Path, ending: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = folder / f"pose.{ending}"
    content = path.read_bytes()
    path.write_bytes(content[:-20])
    assert f"{path}: was altered or not written to its end" in refused(folder, capsys)
    path.unlink()
    assert f"{path}: is missing" in refused(folder, capsys)
    path.write_bytes(content)
    assert md.read(folder).kind == "sweep"


def test_torn_results_are_named(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = folder / f"pose{ENDING}"
    whole = path.read_bytes()
    middle = len(whole) // 2
    turned = bytearray(whole)
    turned[middle] ^= 0xFF
    for content in (b"", b"hello", whole[:-1], whole[:middle], bytes(turned)):
        path.write_bytes(content)
        assert f"{path}: " in refused(folder, capsys)
    path.write_bytes(whole)


def test_other_versions_are_refused(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("mechdae.tasks.export.folder.__version__", "99.0")
    assert "written by mechdae" in refused(folder, capsys)


def test_folders_without_results(
    job: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "holds no results" in refused(tmp_path, capsys)
    with pytest.raises(md.InputError, match="no such folder"):
        md.read(tmp_path / "nowhere")
    shutil.copy(job / "starts.jsonl", tmp_path)
    assert "the job in this folder is not finished: 4 pieces are done" in refused(tmp_path, capsys)
    (tmp_path / "starts.jsonl").unlink()
    (tmp_path / "pose.json").write_text("{}")
    assert "no results that can be read back" in refused(tmp_path, capsys)


def test_results_of_another_problem_are_not_overwritten(
    folder: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    other = tmp_path / "other.toml"
    md.dump(md.load("gorshkov-seven-link"), other)
    assert main(["solve", str(other), "--task", "pose", "--out", str(folder), "--quiet"]) == 2
    assert "holds the result of problem 'gorshkov-seven-link'" in capsys.readouterr().err
    assert {path.name: path.read_bytes() for path in folder.iterdir() if path != other} == before
    words = ["solve", "gorshkov-seven-link", "--task", "pose", "--set", "phi1=0.7", "--quiet"]
    assert main([*words, "--out", str(folder)]) == 0  # of the same problem they are new ones
    assert md.read(folder)["pose"].drivers["crank.angle"].position[0] == 0.7


def test_what_a_folder_does_not_have(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for words, told in (
        (["--task", "turn"], "did you mean pose?"),
        (["--set", "OA=1"], "a result in a folder is what it is"),
        (["--mode", "+"], "a result in a folder is what it is"),
        (["--kind", "losses"], "there are no losses"),
        (["--kind", "page"], "a page solves"),
    ):
        assert main(["plot", str(folder), *words]) == 2
        assert told in capsys.readouterr().err
