"""A job on a Dask cluster: a real scheduler and two workers, one killed in the middle."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

import mechdae as md
from mechdae.design.synthesis.job.run import NAME
from tests.shared.job_cases import FOUR_BAR
from tests.shared.scheme_cases import BEAN

pytest.importorskip("distributed")
STARTS = 24


@pytest.fixture(scope="module")
def path(tmp_path_factory) -> Path:
    file = tmp_path_factory.mktemp("problem") / "arc.toml"
    file.write_text(FOUR_BAR)
    return file


@contextlib.contextmanager
def cluster(
    root: Path, folder: Path
) -> Iterator[tuple[str, subprocess.Popen, list[subprocess.Popen]]]:
    """The address and the process of a scheduler, and its two workers."""
    note = folder / "scheduler.json"
    common = ["--scheduler-file", str(note), "--no-dashboard"]
    scheduler = ["dask_scheduler", "--host", "127.0.0.1", "--port", "0"]
    worker = ["dask_worker", "--nthreads", "1", "--no-nanny", "--memory-limit", "0"]
    running = []
    places = {**os.environ, "PYTHONPATH": str(root)}
    try:
        for words in (scheduler, worker, worker):
            command = [sys.executable, "-m", f"distributed.cli.{words[0]}", *words[1:], *common]
            running.append(
                subprocess.Popen(
                    command,
                    cwd=folder,
                    env=places,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                )
            )
            for _ in range(6000):
                with contextlib.suppress(OSError, ValueError):
                    address = json.loads(note.read_text())["address"]
                    break
                time.sleep(0.01)
        yield address, running[0], running[1:]
    finally:
        for process in running:
            process.kill()
            process.wait()


def job(path: Path, address: str, folder: Path) -> subprocess.Popen:
    command = [sys.executable, "-m", "mechdae", "synthesize", str(path), "--cluster", address]
    words = ["--starts", str(STARTS), "--out", str(folder), "--json", "--quiet"]
    patience = {**os.environ, "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "3s"}
    return subprocess.Popen(
        [*command, *words], env=patience, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def until(process: subprocess.Popen, folder: Path, count: int) -> None:
    """Wait until so many starts are in the log of a job that is running."""
    log = folder / NAME
    while process.poll() is None and not (log.exists() and log.read_bytes().count(b"\n") > count):
        time.sleep(0.002)


def test_a_cluster_gives_the_same_answer_when_workers_and_the_scheduler_are_killed(
    root, path, tmp_path
) -> None:
    with cluster(root, tmp_path) as (address, scheduler, workers):
        first = job(path, address, tmp_path / "first")
        until(first, tmp_path / "first", 4)
        assert first.poll() is None, first.communicate()
        os.kill(workers[0].pid, signal.SIGKILL)
        out, err = first.communicate()
        assert (first.returncode, err) == (0, "")

        second = job(path, address, tmp_path / "second")
        until(second, tmp_path / "second", 4)
        assert second.poll() is None, second.communicate()
        os.kill(scheduler.pid, signal.SIGKILL)
        printed, err = second.communicate()
        assert (second.returncode, printed) == (1, "")
        assert "the executor broke" in err
        assert "Traceback" not in err

    found = json.loads(out)["tasks"]["design"]
    whole = json.loads(json.dumps(md.synthesize(path, starts=STARTS).to_dict()))
    resumed = md.synthesize(path, starts=STARTS, out=tmp_path / "second")
    again = json.loads(json.dumps(resumed.to_dict()))
    for answer in (found, whole, again):
        del answer["summary"]["seconds"]
    assert found == whole
    assert again == whole


def test_a_composition_on_a_cluster_has_the_same_bits(root, tmp_path) -> None:
    file = tmp_path / "bean.toml"
    file.write_text(BEAN.replace("grow = 1", "grow = 0").replace("samples = 600", "samples = 200"))
    with cluster(root, tmp_path) as (address, _, _):
        command = [sys.executable, "-m", "mechdae", "synthesize", str(file), "--cluster", address]
        done = subprocess.run(
            [*command, "--json", "--quiet"], capture_output=True, text=True, check=False
        )
    assert (done.returncode, done.stderr) == (0, "")
    found = json.loads(done.stdout)["tasks"]["scheme"]
    alone = json.loads(json.dumps(md.synthesize(file).to_dict()))
    assert alone["designs"]
    for answer in (found, alone):
        del answer["summary"]["seconds"]
    assert found == alone


@pytest.mark.parametrize("address", ["nonsense", "tcp://nowhere", "host:port"])
def test_a_bad_address_is_refused_at_once(path, address) -> None:
    from mechdae.design.jobs.distribute import cluster

    with pytest.raises(md.InputError, match="is no address"), cluster(address):
        pass
