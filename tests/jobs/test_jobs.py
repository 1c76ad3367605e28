"""Jobs of synthesis: workers, logs, what is killed; the answer must always be the same."""

from __future__ import annotations

import concurrent.futures
import contextlib
import io
import json
import multiprocessing
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mechdae as md
from mechdae.cli.progress import starts_progress
from mechdae.design.jobs.distribute import (
    ATTEMPTS,
    Borrowed,
    Failure,
    Processes,
    Supply,
    distribute,
)
from mechdae.design.synthesis.goals.base import Seed
from mechdae.design.synthesis.ipopt import Optimum
from mechdae.design.synthesis.job.run import NAME, Log
from mechdae.design.synthesis.job.worker import Work, solved, text_of
from tests.shared.command import run
from tests.shared.job_cases import FOUR_BAR

ALL = 12
"""Starts of the job: six for each of two classes."""
MANY = 60
"""Starts of a job that is still at work when somebody comes to stop it."""


@pytest.fixture(scope="module")
def path(tmp_path_factory) -> Path:
    file = tmp_path_factory.mktemp("problem") / "arc.toml"
    file.write_text(FOUR_BAR)
    return file


@pytest.fixture(scope="module")
def long_path(tmp_path_factory) -> Path:
    file = tmp_path_factory.mktemp("problem") / "long.toml"
    text = FOUR_BAR.replace(f"starts = {ALL}", f"starts = {MANY}")
    assert text != FOUR_BAR
    file.write_text(text)
    return file


@pytest.fixture(scope="module")
def reference(path) -> dict:
    """The answer of the job in this process, without a log."""
    return answer(md.synthesize(path))


def answer(result) -> dict:
    """All of an answer but its times."""
    found = json.loads(json.dumps(result.to_dict()))
    found["summary"].pop("seconds")
    return found


def lines(folder: Path) -> list[bytes]:
    log = folder / NAME
    return log.read_bytes().splitlines(keepends=True) if log.exists() else []


def indices(folder: Path) -> list[int]:
    return [json.loads(line)["start"] for line in lines(folder)[1:]]


def works(path: Path, count: int) -> dict[int, Work]:
    """The first starts of the job as they are sent."""
    problem = md.load(path)
    task = problem.tasks["design"]
    sent: dict[int, Work] = {}

    class Asked(concurrent.futures.Executor):
        def submit(self, function, work):  # type: ignore[override]
            sent[len(sent)] = work
            future: concurrent.futures.Future = concurrent.futures.Future()
            future.set_result(function(work))
            return future

    md.synthesize(problem, task, executor=Asked())
    assert len(sent) == ALL
    return {k: sent[k] for k in range(count)}


# -- where starts are solved -----------------------------------------------------------------


def test_the_reference_is_the_tabled_optimum(reference) -> None:
    # five points on an arc (Kunjur and Krishnamurty 1997): 7.41575131e-07 m2, 20 of 20 seeds
    assert reference["summary"]["starts"] == ALL
    assert reference["designs"][0]["objective"] == pytest.approx(7.41575131e-07, rel=1e-6)


def test_two_workers_give_the_same_answer(path, reference) -> None:
    assert answer(md.synthesize(path, workers=2)) == reference


def test_threads_give_the_same_answer(path, reference) -> None:
    with concurrent.futures.ThreadPoolExecutor(3) as executor:
        assert answer(md.synthesize(path, executor=executor)) == reference


def test_what_is_sent_is_small_and_loads_nothing(path) -> None:
    import pickle

    work = works(path, 1)[0]
    assert len(pickle.dumps(work)) < 6000
    modules = "mechdae.design.synthesis.job.worker, mechdae.design.jobs.distribute, sys"
    code = f"import {modules}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"casadi", "numpy"} & {name.split(".")[0] for name in done.stdout.split()}


def test_workers_compute_on_one_thread() -> None:
    before = dict(os.environ)
    with Supply(lambda: Processes(1)) as supply:
        assert supply.pool().submit(os.getenv, "OMP_NUM_THREADS").result() == "1"
    assert dict(os.environ) == before


def test_tables_travel_with_their_numbers(path, tmp_path) -> None:
    (tmp_path / "load.csv").write_text("angle,force\n0,1\n3,2\n")
    file = tmp_path / "loaded.toml"
    table = 'kind = "table"\ncoordinate = "crank.angle"\nfile = "load.csv"\nbody = "rocker"\n'
    file.write_text(FOUR_BAR + f"[loads.gas]\n{table}")
    problem = md.load(file)
    text = text_of(problem, "design", problem.tasks["design"])
    assert "load.csv" not in text
    assert "rows = [[0.0, 1.0], [3.0, 2.0]]" in text
    assert "tasks.turn" not in text


def test_another_version_on_a_worker_is_told(path) -> None:
    work = replace(works(path, 1)[0], version="0.0.1")
    found = solved(work)
    assert isinstance(found, Failure)
    with (
        concurrent.futures.ThreadPoolExecutor(1) as executor,
        pytest.raises(md.SolveError, match=r"start 0: mechdae .* runs there, 0\.0\.1 here"),
    ):
        distribute({0: work}, Supply(lambda: Borrowed(executor)), lambda *_: None, None, solved)


# -- workers that die ------------------------------------------------------------------------


def test_a_killed_worker_loses_nothing(path, reference, tmp_path) -> None:
    moment = random.Random(str(tmp_path)).randrange(1, ALL - 2)
    killed = []

    def kill(done: int, total: int, best: float | None) -> None:
        if done >= moment and not killed:
            killed.append(min(child.pid for child in multiprocessing.active_children()))
            os.kill(killed[0], signal.SIGKILL)

    result = md.synthesize(path, workers=2, out=tmp_path, progress=kill)
    assert killed, moment
    assert answer(result) == reference, moment
    assert sorted(indices(tmp_path)) == list(range(ALL))


class Bomb:
    """Kills the process that unpacks it."""

    def __reduce__(self):
        return os._exit, (9,)


def test_a_start_that_kills_its_worker_is_named_and_the_others_are_solved(path) -> None:
    sent = works(path, 3)
    sent[1] = replace(sent[1], values={"d": Bomb()})
    taken: dict[int, Optimum] = {}
    pools = []

    def pool() -> Processes:
        pools.append(1)
        return Processes(1)

    with (
        pytest.raises(md.SolveError, match=f"start 1 was lost {ATTEMPTS} times"),
        Supply(pool) as supply,
    ):
        distribute(sent, supply, taken.__setitem__, 2, solved)
    assert sorted(taken) == [0, 2]
    assert len(pools) == ATTEMPTS


def test_a_broken_executor_of_the_user_is_an_error_and_the_log_is_kept(path, tmp_path) -> None:
    class Breaks(concurrent.futures.ThreadPoolExecutor):
        count = 0

        def submit(self, *arguments):  # type: ignore[override]
            self.count += 1
            if self.count == 5:
                raise concurrent.futures.BrokenExecutor("all gone")
            return super().submit(*arguments)

    with Breaks(1) as executor, pytest.raises(md.SolveError, match="broke: all gone"):
        md.synthesize(path, executor=executor, out=tmp_path)
    assert sorted(indices(tmp_path)) == [0, 1, 2, 3]


# -- jobs that are killed --------------------------------------------------------------------


@contextlib.contextmanager
def job(path: Path, folder: Path, workers: int, reached: int) -> Iterator[subprocess.Popen]:
    """A job in a process group of its own, once so many starts are in its log."""
    command = [sys.executable, "-m", "mechdae", "synthesize", str(path), "--out", str(folder)]
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
    process = subprocess.Popen(
        [*command, "--workers", str(workers)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    try:
        while len(lines(folder)) <= reached and process.poll() is None:
            time.sleep(0.001)
        with contextlib.suppress(ProcessLookupError):
            process.send_signal(signal.SIGSTOP)  # it must not end while it is looked at
        yield process
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        process.communicate()


def children(pid: int) -> list[int]:
    return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="reads /proc")
def test_a_killed_job_goes_on_to_the_same_answer(long_path, tmp_path) -> None:
    draw = random.Random(str(tmp_path))
    reached = 0
    for workers in (2, 1):
        reached += draw.randrange(1, 5)
        with job(long_path, tmp_path, workers, reached) as process:
            orphans = children(process.pid) if workers == 2 else []
            with pytest.raises(md.InputError, match="another process is working"):
                md.synthesize(long_path, out=tmp_path)
            process.kill()
            assert process.wait() == -signal.SIGKILL, process.communicate()
        before = lines(tmp_path)
        assert reached < len(before) <= MANY + 1
        for _ in range(2000):
            if not any(map(alive, orphans)):
                break
            time.sleep(0.005)
        else:
            raise AssertionError(f"workers {orphans} outlive their job")
    resumed = md.synthesize(long_path, out=tmp_path)
    whole = [line for line in before if line.endswith(b"\n")]
    assert lines(tmp_path)[: len(whole)] == whole
    assert sorted(indices(tmp_path)) == list(range(MANY))
    assert answer(resumed) == answer(md.synthesize(long_path))


@pytest.mark.parametrize("workers", [1, 2])
def test_ctrl_c_keeps_what_is_finished(long_path, tmp_path, workers) -> None:
    with job(long_path, tmp_path, workers, 3) as process:
        os.killpg(process.pid, signal.SIGINT)
        os.killpg(process.pid, signal.SIGCONT)
        out, err = process.communicate()
    assert process.returncode == 130, err
    assert out == ""
    count = len(indices(tmp_path))
    assert err.splitlines() == [
        f"mechdae: {count} of {MANY} starts are kept in {tmp_path}; the same command goes on there",
        "mechdae: interrupted",
    ]
    assert 3 <= count <= MANY


# -- the log ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def logged(path, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("logged")
    md.synthesize(path, out=folder)
    return folder


def opened(path: Path, folder: Path) -> Log:
    problem = md.load(path)
    return Log(folder, text_of(problem, "design", problem.tasks["design"]), "design")


def copied(content: bytes, folder: Path) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / NAME).write_bytes(content)
    return folder


def test_a_finished_job_is_read_to_the_last_bit(path, reference, logged) -> None:
    before = lines(logged)
    calls: list[tuple] = []
    result = md.synthesize(path, out=logged, progress=lambda *call: calls.append(call))
    assert answer(result) == reference
    assert lines(logged) == before
    assert calls[-1][:2] == (ALL, ALL)
    assert {call[1] for call in calls} == {ALL}
    assert len(calls) <= 2  # a call for each round of starts, none for a start
    assert calls[-1][2] == pytest.approx(7.41575131e-07, rel=1e-5)


def test_optima_come_back_with_all_bits(path, tmp_path) -> None:
    odd = np.array([0.1, -0.0, 5e-324, np.inf, -np.inf, np.nan, 1 / 3])
    found = Optimum(odd, np.nan, np.inf, "Maximum_Iterations_Exceeded", 7, 0.1, odd[:0], odd)
    start = (0, Seed({"d": odd}, {"sense": 1.0}, 0.5))
    with opened(path, tmp_path) as log:
        log.known({3: start})
        log.put(3, start, found)
        log.put(3, start, replace(found, status="twice"))
    with opened(path, tmp_path) as log:
        again = log.known({3: start})[3]
        with pytest.raises(md.InputError, match="start 3 there is not the one"):
            log.known({3: (1, start[1])})
    assert len(log.finished) == 1
    assert again.z.tobytes() == found.z.tobytes()
    assert again.bound_prices.shape == (0,)
    assert (str(again.objective), again.violation, again.status) == ("nan", np.inf, found.status)
    assert (again.iterations, again.seconds) == (7, 0.1)


def test_a_job_with_more_starts_goes_on_with_the_same_bits(path, logged, tmp_path) -> None:
    """Starts that were solved are read, whatever their place among more or fewer is."""
    known = {json.loads(line)["drawn"] for line in lines(logged)[1:]}
    copied((logged / NAME).read_bytes(), tmp_path / "more")
    whole = answer(md.synthesize(path, starts=3 * ALL, out=tmp_path / "whole"))
    assert answer(md.synthesize(path, starts=3 * ALL, out=tmp_path / "more")) == whole
    assert whole["summary"]["starts"] == 3 * ALL
    drawn = {json.loads(line)["drawn"] for line in lines(tmp_path / "whole")[1:]}
    added = [json.loads(line)["drawn"] for line in lines(tmp_path / "more")[1 + ALL :]]
    assert len(known & drawn) >= ALL / 2
    assert sorted(added) == sorted(drawn - known)
    before = lines(tmp_path / "more")
    fewer = md.synthesize(path, out=tmp_path / "more")
    assert answer(fewer) == answer(md.synthesize(path))
    assert lines(tmp_path / "more") == before


def test_a_torn_line_is_cut_off_wherever_it_is_torn(path, logged, tmp_path) -> None:
    whole = (logged / NAME).read_bytes()
    ends = [k + 1 for k, byte in enumerate(whole) if byte == ord("\n")]
    cuts = random.Random(5).sample(range(len(whole)), 60)
    for cut in [*cuts, 0, 1, 9, ends[0] - 1, ends[0], ends[3] - 1, ends[3], ends[3] + 1]:
        folder = copied(whole[:cut], tmp_path / "torn")
        with opened(path, folder) as log:
            kept = sum(end <= cut for end in ends)
            assert len(log.finished) == max(kept - 1, 0), cut
        assert (folder / NAME).read_bytes() == whole[: ends[kept - 1] if kept else 0]


def test_a_torn_job_gives_the_same_answer(path, reference, logged, tmp_path) -> None:
    whole = lines(logged)
    copied(b"".join(whole[:4]) + whole[4][:-20], tmp_path)
    assert answer(md.synthesize(path, out=tmp_path)) == reference
    assert lines(tmp_path)[:4] == whole[:4]
    assert sorted(indices(tmp_path)) == list(range(ALL))


def test_a_line_that_cannot_be_read_is_solved_again(path, logged, tmp_path) -> None:
    whole = lines(logged)
    for bad in (b"\0" * 30 + b"\n", b"[]\n", b'{"start": 1}\n', b'{"start": "x"}\n'):
        copied(b"".join([whole[0], bad, *whole[2:5]]), tmp_path)
        with opened(path, tmp_path) as log:
            assert len(log.finished) == 3


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"seed": 4}, "tasks.design.seed is 3 there, 4 here"),
        ({"r2": 2.5}, "parameters.r2 is 2.0 there, 2.5 here"),
        ({"target": "[3, 3.1]"}, r"tasks.design.goal.targets\[0\]\[1\] is 3.0 there, 3.1 here"),
        ({"bound": "60"}, r"tasks.design.free.r3\[1\] is 50.0 there, 60.0 here"),
    ],
)
def test_a_folder_of_another_job_says_what_differs(path, logged, tmp_path, change, words) -> None:
    text = FOUR_BAR.replace("[[3, 3]", f"[{change.pop('target', '[3, 3]')}")
    text = text.replace("r3 = [5e-5, 50]", f"r3 = [5e-5, {change.pop('bound', '50')}]")
    file = tmp_path / "arc.toml"
    file.write_text(text)
    problem = md.load(file)
    if "r2" in change:
        problem = problem.with_values({"r2": change.pop("r2")})
    before = lines(logged)
    with pytest.raises(md.InputError, match=f"holds another job: {words}"):
        md.synthesize(problem, out=logged, **change)
    assert lines(logged) == before


def test_other_starts_and_versions_of_the_same_job_are_refused(path, logged, tmp_path) -> None:
    head, first, *_ = map(json.loads, lines(logged))
    assert first["of"] == ALL
    pair = [{**head}, {**first, "drawn": "0" * 32}]
    copied("".join(json.dumps(line) + "\n" for line in pair).encode(), tmp_path)
    with pytest.raises(md.InputError, match=r"start \d+ there is not the one that is drawn here"):
        md.synthesize(path, out=tmp_path)
    copied(json.dumps({**head, "mechdae": "0.0.1"}).encode() + b"\n", tmp_path)
    with pytest.raises(md.InputError, match=r"mechdae is 0\.0\.1 there"):
        md.synthesize(path, out=tmp_path)


@pytest.mark.parametrize("content", [b"hello\n", b"[1]\n", b"no end", b'{"a": 1}\n'])
def test_a_file_that_is_no_log_is_left_alone(path, tmp_path, content) -> None:
    copied(content, tmp_path)
    with pytest.raises(md.InputError, match="no log of a job"):
        md.synthesize(path, out=tmp_path)
    assert (tmp_path / NAME).read_bytes() == content


# -- the command -----------------------------------------------------------------------------


def test_the_command_writes_designs_that_solve_and_plot_take(capsys, path, tmp_path) -> None:
    code, out, err = run(capsys, "synthesize", str(path), "--out", str(tmp_path))
    assert code == 0
    assert "crank-rocker" in out
    assert "census    12 starts" in out
    assert "\r" not in err
    names = {"design.json", "design.csv", "design.npz", "design-1.toml", "starts.jsonl"}
    assert names <= {file.name for file in tmp_path.iterdir()}
    head, first = (tmp_path / "design.csv").read_text().splitlines()[:2]
    row = dict(zip(head.split(","), first.split(","), strict=True))
    found = md.load(tmp_path / "design-1.toml")
    assert float(row["r2"]) == found.mechanism.values()["r2"]
    code, out, _ = run(capsys, "solve", str(tmp_path / "design-1.toml"), "--json")
    assert code == 0
    assert set(json.loads(out)["tasks"]["path"]["status"]) == {"ok"}
    drawn = run(capsys, "plot", str(tmp_path / "design-1.toml"), "--out", str(tmp_path))
    assert drawn[0] == 0


def test_solve_uses_the_files_own_starts_and_seed(capsys, path, reference) -> None:
    code, out, _ = run(capsys, "solve", str(path), "--task", "design", "--json")
    assert code == 0
    found = json.loads(out)["tasks"]["design"]
    found["summary"].pop("seconds")
    assert found == reference


def test_show_tells_what_is_searched_and_plot_draws_the_best(capsys, path, tmp_path) -> None:
    code, out, _ = run(capsys, "show", str(path))
    assert code == 0
    free = "6 free parameters: r1, r2, r3, r4, r_cx, r_cy"
    assert f"design: synthesis, goal path, 12 starts, {free}" in out
    words = ["plot", str(path), "--task", "design", "--out", str(tmp_path)]
    code, out, err = run(capsys, *words)
    assert (code, err) == (0, "")
    assert out.strip().endswith("-design-design.svg")


def test_none_found_is_exit_code_1(capsys, path, tmp_path, monkeypatch) -> None:
    rejected = [{"objective": 2.5, "reasons": ["the input does not turn fully"]}]
    monkeypatch.setattr("mechdae.design.synthesis.synthesize.designs", lambda *_: ([], rejected))
    code, out, err = run(capsys, "synthesize", str(path), "--out", str(tmp_path))
    assert code == 1
    assert "rejected  objective 2.5 m2: the input does not turn fully" in out
    assert "no design found from 12 starts" in err
    assert (tmp_path / "design.json").exists()
    assert not (tmp_path / "design-1.toml").exists()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--starts", "0"], "--starts"),
        (["--workers", "0"], "--workers"),
        (["--seed", "-1"], "--seed"),
        (["--task", "turn"], "tasks.turn: is of kind 'sweep', not synthesis"),
        (["--task", "desing"], "did you mean design"),
        (["--cluster", "tcp://127.0.0.1:1", "--workers", "2"], "not together with --workers"),
    ],
)
def test_bad_usage_is_exit_code_2(capsys, path, words, told) -> None:
    code, out, err = run(capsys, "synthesize", str(path), *words)
    assert (code, out) == (2, "")
    assert told in err


def test_a_missing_extra_is_told_with_its_command(capsys, path, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    code, _, err = run(capsys, "synthesize", str(path), "--cluster", "tcp://127.0.0.1:8786")
    assert code == 2
    assert "pip install 'mechdae[cluster]'" in err


def test_python_refuses_what_makes_no_sense(path) -> None:
    for words in ({"workers": 0}, {"workers": True}, {"starts": 0}, {"seed": -1}):
        with pytest.raises(md.InputError, match=next(iter(words))):
            md.synthesize(path, **words)  # type: ignore[arg-type]
    with (
        concurrent.futures.ThreadPoolExecutor(1) as executor,
        pytest.raises(md.InputError, match="'workers' and 'executor'"),
    ):
        md.synthesize(path, workers=2, executor=executor)
    with pytest.raises(md.InputError, match="no task of kind synthesis"):
        md.synthesize("slider-crank")


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_progress_is_for_terminals_only(monkeypatch) -> None:
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    assert starts_progress() is None
    screen = Terminal()
    monkeypatch.setattr(sys, "stderr", screen)
    assert starts_progress(quiet=True) is None
    clock = iter([0.0, 0.0, 10.0, 4000.0, 5000.0])
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    show = starts_progress()
    assert show is not None
    show(20, 80, None)
    show(30, 80, 0.125)
    show(31, 80, 0.125)
    show(80, 80, 0.125)
    shown = screen.getvalue().replace("\033[K", "").split("\r")[1:]
    assert shown == [
        "starts 20 of 80",
        "starts 30 of 80, best so far 0.125, 50 s left",
        "starts 31 of 80, best so far 0.125, 5 h left",
        "",
    ]
