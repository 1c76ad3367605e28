"""Kernels on disk: found again with the same bits, private, verified, bounded, safe in a crowd."""

from __future__ import annotations

import json
import multiprocessing
import os
import subprocess
import sys
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.kernels.graphs import kinetostatics, pose, steps
from mechdae.kernels.stored import functions
from mechdae.kernels.stored.folder import HEAD, VARIABLE, Folder, place
from mechdae.motion.kinematics import prepared
from tests.shared.force_cases import slider_crank
from tests.shared.paths import ROOT

X = ca.SX.sym("x", 2)
posix = pytest.mark.skipif(not hasattr(os, "getuid"), reason="modes and owners are POSIX's")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Folder:
    """Return an empty folder that this process keeps its kernels in."""
    monkeypatch.setenv(VARIABLE, str(tmp_path / "kept"))
    own = Folder(tmp_path / "kept")
    monkeypatch.setattr(functions, "folder", lambda: own)
    prepared.SHAPES.clear()
    yield own
    prepared.SHAPES.clear()


def builds(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return a list that grows with each kernel of a step that is built."""
    made: list[str] = []
    tube = steps.Graphs._tube

    def counting(self, *args, **keys):
        made.append("tube")
        return tube(self, *args, **keys)

    monkeypatch.setattr(steps.Graphs, "_tube", counting)
    return made


@pytest.mark.parametrize("name", ["four-bar-crank-rocker", "jansen-leg", "five-bar-robot"])
def test_the_second_process_reads_what_the_first_has_built(name, folder, monkeypatch) -> None:
    made, task = builds(monkeypatch), next(iter(md.load(name).tasks))
    monkeypatch.setattr(functions, "folder", lambda: None)
    without = md.solve(name, task).to_dict()
    monkeypatch.setattr(functions, "folder", lambda: folder)
    prepared.SHAPES.clear()
    first = md.solve(name, task).to_dict()
    count = len(made)
    assert count
    assert len(folder.files()) >= 3
    prepared.SHAPES.clear()
    second = md.solve(name, task).to_dict()
    assert len(made) == count  # no step was built again
    assert json.dumps(first) == json.dumps(without)
    assert json.dumps(second) == json.dumps(without)


def forced(monkeypatch: pytest.MonkeyPatch, friction: str = "coupled", **keys: float) -> tuple:
    """Return efforts and reactions of a slider-crank, and how many functions were built."""
    made: list[str] = []
    function = kinetostatics.Balance.function

    def counting(self, name, *args, **keys):
        made.append(name)
        return function(self, name, *args, **keys)

    prepared.SHAPES.clear()
    task = md.Reactions(
        md.Driver("crank.angle", from_=0, to=6, speed=20.0), poses=40, friction=friction
    )
    with monkeypatch.context() as patch:
        patch.setattr(kinetostatics.Balance, "function", counting)
        result = md.solve(slider_crank(inertia=True, **keys), task)
        assert result.fault is None
    values = [result.efforts["crank.angle"], *(j["reaction"] for j in result.joints.values())]
    return values, made


def test_kernels_of_forces_are_read_too(folder: Folder, monkeypatch) -> None:
    """The same bits, nothing built; another law or structure of friction has other kernels."""
    first, made = forced(monkeypatch)
    assert "quick" in made
    again, none = forced(monkeypatch)
    assert none == []
    assert all(np.array_equal(a, b) for a, b in zip(first, again, strict=True))
    assert forced(monkeypatch, f=0.2, r=0.09)[1] == []  # other numbers
    assert forced(monkeypatch, friction="none")[1] != []
    assert forced(monkeypatch, gravity=(0.0, -9.81))[1] != []
    for _, _, path in folder.files():
        path.write_bytes(path.read_bytes()[:-9])
    whole, made = forced(monkeypatch)
    assert "quick" in made
    assert all(np.array_equal(a, b) for a, b in zip(first, whole, strict=True))


def test_other_equations_have_other_names(folder) -> None:
    names = set()
    for title in ("four-bar-crank-rocker", "slider-crank", "jansen-leg", "gorshkov-seven-link"):
        prepared.SHAPES.clear()
        md.solve(title, next(iter(md.load(title).tasks)))
        own = {path.name for _, _, path in folder.files()}
        assert len(own) > len(names)
        names = own
    same = [functions.fingerprint(ca.Function("f", [X], [X * k])) for k in (2, 2, 3)]
    assert same[0] == same[1] != same[2]
    assert functions.fingerprint("ab", "c") != functions.fingerprint("a", "bc")


def test_other_versions_have_other_names(monkeypatch) -> None:
    before = functions.fingerprint("a")
    for name, value in (("__version__", "9.9.9"), ("SOURCES", ("kernels",))):
        with monkeypatch.context() as patch:
            patch.setattr(functions, name, value)
            functions.versions.cache_clear()
            assert functions.fingerprint("a") != before
    functions.versions.cache_clear()
    assert functions.fingerprint("a") == before


def test_kernels_with_curves_are_not_kept(folder) -> None:
    md.solve("cam-roller-follower", next(iter(md.load("cam-roller-follower").tasks)))
    assert not folder.files()


@pytest.mark.parametrize("damage", ["cut", "bit", "name", "empty", "head", "text"])
def test_damaged_files_are_built_anew(damage: str, folder: Folder) -> None:
    function = ca.Function("f", [X], [ca.sin(X)])
    made: list[int] = []

    def make():
        made.append(1)
        return function

    functions.stored("a", make)
    functions.stored("a", make)
    assert len(made) == 1
    file = folder.files()[0][2]
    data = bytearray(file.read_bytes())
    if damage == "cut":
        data = data[:-7]
    elif damage == "bit":
        data[len(data) // 2] ^= 4
    elif damage == "empty":
        data = bytearray()
    elif damage == "head":
        data[: len(HEAD)] = b"x" * len(HEAD)
    elif damage == "text":  # whole, but nothing that casadi knows
        folder.write("a", "no function")
        data = bytearray(file.read_bytes())
    file.write_bytes(bytes(data))
    if damage == "name":
        os.replace(file, folder.path / "b.kernel")
    found = functions.stored("b" if damage == "name" else "a", make)
    assert np.array_equal(np.array(found([1, 2])), np.array(function([1, 2])))
    assert len(made) == 2
    functions.stored("b" if damage == "name" else "a", make)
    assert len(made) == 2


@posix
def test_only_a_private_folder_of_ones_own_is_used(tmp_path: Path, monkeypatch) -> None:
    own = Folder(tmp_path / "kept")
    own.write("a", "text")
    assert own.path.stat().st_mode & 0o777 == 0o700
    assert own.files()[0][2].stat().st_mode & 0o077 == 0
    assert own.read("a") == "text"
    for mode in (0o755, 0o770, 0o701):
        own.path.chmod(mode)
        assert "open to others" in own.fault
        assert own.read("a") is None
        own.write("b", "text")
    own.path.chmod(0o700)
    assert own.read("a") == "text"
    assert own.read("b") is None
    monkeypatch.setattr(os, "getuid", lambda: own.path.stat().st_uid + 1)
    assert own.read("a") is None
    monkeypatch.undo()
    (tmp_path / "link").symlink_to(own.path)
    assert Folder(tmp_path / "link").read("a") is None
    os.replace(own._file("a"), tmp_path / "elsewhere")
    own._file("a").symlink_to(tmp_path / "elsewhere")
    assert own.read("a") is None


@pytest.mark.parametrize("where", ["/proc/1/nowhere/kept", "/dev/null/kept", "file"])
def test_a_folder_that_cannot_be_written_is_no_error(where: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    own = Folder(tmp_path / where if where == "file" else Path(where))
    own.write("a", "text")
    assert own.read("a") is None
    assert own.files() == []


def test_a_full_disk_is_no_error(folder: Folder, monkeypatch) -> None:
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    folder.write("a", "text")
    monkeypatch.undo()
    assert folder.read("a") is None
    assert not [path for _, _, path in folder.files() if path.exists()]


def test_the_folder_stays_bounded(folder: Folder) -> None:
    folder.most_bytes = 20_000
    for k in range(200):
        folder.write(f"k{k}", "x" * 500)
        os.utime(folder._file(f"k{k}"), (k, k)) if folder._file(f"k{k}").exists() else None
    files = folder.files()
    assert sum(size for _, size, _ in files) <= 20_000 + 64 * 600
    assert folder.read("k199") == "x" * 500
    assert folder.read("k0") is None
    folder.write("large", "x" * 17_000_000)
    assert folder.read("large") is None


def _crowd(path: str, k: int) -> int:
    own, bad = Folder(Path(path)), 0
    for i in range(60):
        name = f"n{i % 7}"
        text = own.read(name)
        bad += text is not None and text != name * 4000
        own.write(name, name * 4000)
        if i % 20 == k:
            own.shrink(30_000)
    return bad


def test_processes_that_write_at_once_read_whole_texts_only(tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")
    with context.Pool(3) as pool:
        assert pool.starmap(_crowd, [(str(tmp_path / "kept"), k) for k in range(3)]) == [0, 0, 0]


def test_where_the_folder_is(monkeypatch, tmp_path: Path) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert place() == tmp_path / "mechdae"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    assert place() == Path.home() / ".cache" / "mechdae"
    monkeypatch.setenv(VARIABLE, "0")
    assert place() is None


def test_the_command_tells_and_clears(monkeypatch, tmp_path: Path, capsys) -> None:
    monkeypatch.setenv(VARIABLE, str(tmp_path / "kept"))
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    call = [sys.executable, "-m", "mechdae", "solve", "four-bar-crank-rocker", "--task", "turn"]
    texts = [
        subprocess.run(call, env=env, cwd=ROOT, capture_output=True, check=True).stdout
        for _ in range(2)
    ]
    assert texts[0] == texts[1]
    assert main(["cache"]) == 0
    assert "kernels, 0.1 MB of at most 128 MB" in capsys.readouterr().out
    assert main(["cache", "--clear"]) == 0
    assert "taken away" in capsys.readouterr().out
    assert not list((tmp_path / "kept").iterdir())
    monkeypatch.setenv(VARIABLE, "0")
    assert main(["cache"]) == 0
    assert "nothing is kept" in capsys.readouterr().out
    if hasattr(os, "getuid"):
        monkeypatch.setenv(VARIABLE, str(tmp_path / "kept"))
        (tmp_path / "kept").chmod(0o755)
        assert main(["cache"]) == 2
        assert "open to others" in capsys.readouterr().err


def test_names_are_of_what_kernels_are_built_from() -> None:
    assert isinstance(pose.PoseGraphs.__dict__["pose"], functions.stored_property)
    assert isinstance(steps.Graphs.__dict__["advance"], functions.stored_property)
