"""Studies as jobs: the same table wherever they are computed and however often they are broken."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.design.jobs import log as job_log
from mechdae.tasks import export

PATH = "bodies/rocker/angle"
COUNT = 400


def problem(poses: int = 30) -> md.Problem:
    found = md.load("four-bar-crank-rocker")
    name = next(name for name, task in found.tasks.items() if type(task) is md.Sweep)
    task = replace(found.tasks[name], poses=poses)
    task = replace(task, driver=replace(task.all_drivers[0], range=None, from_=0.0, to=6.0))
    return md.Problem(found.mechanism, {"turn": task}, name="four-bar")


def sets(count: int = COUNT) -> dict[str, list[float]]:
    rng, base = np.random.default_rng(4), problem().mechanism.values()
    return {n: (base[n] * (1 + 0.1 * rng.uniform(-1, 1, count))).tolist() for n in "abcd"}


def test_processes_threads_and_folders_give_one_table(tmp_path: Path) -> None:
    here = md.study(problem(), sets=sets(), of="turn", outputs=[PATH], out=tmp_path / "one")
    two = md.study(problem(), sets=sets(), of="turn", outputs=[PATH], workers=2)
    with ThreadPoolExecutor(2) as pool:
        three = md.study(problem(), sets=sets(), of="turn", outputs=[PATH], executor=pool)
    for other in (two, three):
        assert np.array_equal(here.table[PATH], other.table[PATH], equal_nan=True)
        assert list(here.status) == list(other.status)


def test_the_executor_of_a_dask_cluster_gives_the_same_table(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    asked = {"sets": sets(), "of": "turn", "outputs": [PATH]}
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        there = md.study(problem(), executor=client.get_executor(pure=False), **asked)
    here = md.study(problem(), out=tmp_path, **asked)
    assert there.table[PATH].shape == (COUNT, 30)
    assert np.array_equal(here.table[PATH], there.table[PATH], equal_nan=True)
    assert list(here.status) == list(there.status)


def lines(folder: Path) -> int:
    log = folder / "study.sets.jsonl"
    return log.read_bytes().count(b"\n") if log.exists() else 0


def test_a_killed_study_goes_on_to_the_same_table(tmp_path: Path) -> None:
    whole = md.study(problem(), sets=sets(), of="turn", outputs=[PATH], out=tmp_path / "whole")
    folder = tmp_path / "killed"
    code = (
        "import time, mechdae as md\n"
        "from tests.studies.test_study_jobs import PATH, problem, sets\n"
        f"md.study(problem(), sets=sets(), of='turn', outputs=[PATH], out={str(folder)!r},\n"
        "         progress=lambda done, total: time.sleep(0.2))\n"
    )
    child = subprocess.Popen([sys.executable, "-c", code])
    end = time.monotonic() + 120
    while lines(folder) < 3 and time.monotonic() < end:
        time.sleep(0.02)
    child.send_signal(signal.SIGKILL)
    child.wait()
    before = lines(folder)
    assert 3 <= before < lines(tmp_path / "whole")
    with (folder / "study.sets.jsonl").open("ab") as file:
        file.write(b'{"portion": 6, "sta')  # a line that was not finished
    done: list[int] = []
    again = md.study(
        problem(), sets=sets(), of="turn", outputs=[PATH], out=folder,
        progress=lambda count, _: done.append(count),
    )  # fmt: skip
    assert done[0] > 0
    assert np.array_equal(whole.table[PATH], again.table[PATH], equal_nan=True)
    assert list(whole.status) == list(again.status)
    assert lines(folder) == lines(tmp_path / "whole")


def test_rows_that_were_damaged_are_computed_again(tmp_path: Path) -> None:
    asked = {"sets": sets(), "of": "turn", "outputs": [PATH], "out": tmp_path}
    first = np.array(md.study(problem(), **asked).table[PATH])
    rows = tmp_path / "study.rows" / "0.npy"
    content = bytearray(rows.read_bytes())
    content[-8:] = np.array([7.0]).tobytes()
    rows.write_bytes(content)
    assert np.array_equal(md.study(problem(), **asked).table[PATH], first, equal_nan=True)


@pytest.mark.parametrize("change", ["sets", "outputs", "problem", "certify"])
def test_a_folder_of_another_study_is_refused(change: str, tmp_path: Path) -> None:
    asked = {"sets": sets(8), "of": "turn", "outputs": [PATH], "out": tmp_path}
    md.study(problem(), **asked)
    before = (tmp_path / "study.sets.jsonl").read_bytes()
    other, keys = problem(), dict(asked)
    if change == "sets":
        keys["sets"] = {**sets(8), "a": [0.04] * 8}
    elif change == "outputs":
        keys["outputs"] = ["bodies/coupler/angle"]
    elif change == "certify":
        keys["certify"] = False
    else:
        other = problem(31)
    with pytest.raises(md.InputError, match="holds another job"):
        md.study(other, **keys)
    assert (tmp_path / "study.sets.jsonl").read_bytes() == before


def test_a_full_disk_is_named_and_nothing_is_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = {"sets": sets(), "of": "turn", "outputs": [PATH], "out": tmp_path}
    right, written = os.write, []

    def full(file: int, content: bytes) -> int:
        written.append(file)
        if len(written) > 3:
            raise OSError(28, "No space left on device")
        return right(file, content)

    with monkeypatch.context() as patch:
        patch.setattr(job_log.os, "write", full)
        with pytest.raises(md.SolveError, match="No space left on device"):
            md.study(problem(), **asked)
    kept = lines(tmp_path)
    assert kept == 3
    result = md.study(problem(), **asked)
    assert set(result.status) <= {"ok", "unassembled"}
    reference = md.study(problem(), **{**asked, "out": tmp_path / "other"})
    assert np.array_equal(result.table[PATH], reference.table[PATH], equal_nan=True)


def test_a_nan_in_a_column_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    md.dump(problem(10), tmp_path / "p.toml")
    table = sets(6)
    rows = [[str(table[name][k]) for name in "abcd"] for k in range(6)]
    rows[2][1], rows[4][0] = "nan", ""
    text = "\n".join([",".join("abcd"), *map(",".join, rows)])
    (tmp_path / "sets.csv").write_text(text)
    words = ["study", str(tmp_path / "p.toml"), "--sets", str(tmp_path / "sets.csv"), "--of"]
    words += ["turn", "--outputs", PATH, "--json", "--out", str(tmp_path / "out")]
    assert main(words) == 0
    task = json.loads(capsys.readouterr().out)["tasks"]["study"]
    assert [entry["set"] for entry in task["summary"]["faults"]] == [2, 4]
    assert task["summary"]["certified"] is True
    assert task["parameters"]["b"][2] is None
    assert [row[0] is None for row in task["table"][PATH]] == [
        *[False, False, True, False, True, False]
    ]
    with np.load(tmp_path / "out" / "study.npz") as saved:
        assert saved[f"{PATH}[3]"][0] == task["table"][PATH][0][3]


def test_the_command_varies_and_screens(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["study", "four-bar-crank-rocker", "--vary", "a_mm=38:42:3", "--vary", "b=0.11:0.12:2"]
    words += ["--outputs", "points/coupler.C/position", "--screen", "--json"]
    code = main(words)
    out = capsys.readouterr()
    assert code == 0, out.err
    task = next(iter(json.loads(out.out)["tasks"].values()))
    assert task["parameters"]["a"] == pytest.approx([0.038, 0.038, 0.04, 0.04, 0.042, 0.042])
    assert task["summary"]["certified"] is False
    assert main([*words[:3], "a=1:2", *words[4:]]) == 2
    assert "NAME=FROM:TO:COUNT" in capsys.readouterr().err


def test_large_tables_are_written_in_pieces_as_small_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = md.study(problem(12), sets=sets(20), of="turn", outputs=[PATH])
    export.save(result, tmp_path / "whole")
    monkeypatch.setattr("mechdae.tasks.export.files.AT_ONCE", 50)
    export.save(result, tmp_path / "pieces")
    texts = [(tmp_path / name / "study.json").read_text() for name in ("whole", "pieces")]
    assert json.loads(texts[0]) == json.loads(texts[1])
    csv = [(tmp_path / name / "study.csv").read_bytes() for name in ("whole", "pieces")]
    assert csv[0] == csv[1]
