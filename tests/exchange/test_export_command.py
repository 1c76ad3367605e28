"""``mechdae export`` and ``mechdae new --from``: outputs, refusals, nothing half-written."""

from __future__ import annotations

from pathlib import Path

import pytest

import mechdae as md
from mechdae.parts.exchange import formats
from tests.shared.command import run
from tests.shared.paths import DATA

FORMATS = ("dxf", "mjcf", "sdf", "urdf", "c", "js")


@pytest.mark.parametrize("form", FORMATS)
def test_the_same_bytes_twice(form: str, tmp_path: Path, capsys) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    words = ("export", "slider-crank", "--format", form, "--out")
    code, out, err = run(capsys, *words, str(one))
    assert (code, err) == (0, "")
    assert out.split()[0] == str(one)
    assert run(capsys, *words, str(two))[0] == 0
    assert one.read_bytes() == two.read_bytes()
    assert len(list(tmp_path.iterdir())) == (4 if form in ("urdf", "c") else 2)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("slider-crank", "--format", "iges"), "unknown format 'iges'"),
        (("slider-crank", "--format", "mjfc"), "did you mean mjcf?"),
        (("slider-crank", "--format", "c", "--pose", "3"), "no option of format c"),
        (("slider-crank", "--format", "dxf", "--pose", "999"), "there is no pose 999"),
        (("slider-crank", "--format", "mjcf", "--task", "modes"), "not of modes"),
        (("slider-crank", "--format", "mjcf", "--task", "trun"), "unknown task 'trun'"),
        (("rssr", "--format", "dxf"), "mechanisms of the plane"),
        (("no-such", "--format", "dxf"), "no-such"),
        (("slider-crank", "--format", "urdf", "--tolerance", "-1"), "above 0"),
    ],
)
def test_bad_usage_is_one_message_and_no_file(words, told: str, tmp_path: Path, capsys) -> None:
    target = tmp_path / "out.file"
    code, out, err = run(capsys, "export", *words, "--out", str(target))
    assert (code, out) == (2, "")
    assert told in err
    assert not list(tmp_path.iterdir())


def test_files_that_are_there_stay(tmp_path: Path, capsys) -> None:
    target, side = tmp_path / "robot.urdf", tmp_path / "robot.urdf.loops.json"
    words = ("export", "slider-crank", "--format", "urdf", "--out", str(target))
    side.write_text("mine")
    code, _, err = run(capsys, *words)
    assert code == 2
    assert "robot.urdf.loops.json: exists already" in err
    assert side.read_text() == "mine"
    assert not target.exists()
    assert run(capsys, *words, "--overwrite")[0] == 0
    assert side.read_text() != "mine"
    assert run(capsys, "export", "slider-crank", "--format", "c", "--out", str(tmp_path))[0] == 2
    words = ("export", "slider-crank", "--format", "c", "--out", str(tmp_path / "crank.h"))
    assert "another file of this export" in run(capsys, *words)[2]
    gone = str(tmp_path / "none" / "x.c")
    code, _, err = run(capsys, "export", "slider-crank", "--format", "c", "--out", gone)
    assert code == 2
    assert "no such folder" in err


def test_nothing_is_half_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = md.export("slider-crank", format="urdf")
    opened = formats.whole_file
    calls = []

    def failing(path):
        calls.append(path)
        if len(calls) == 2:
            raise OSError(28, "No space left on device", str(path))
        return opened(path)

    monkeypatch.setattr(formats, "whole_file", failing)
    with pytest.raises(OSError, match="No space left"):
        made.save(tmp_path / "robot.urdf")
    assert not list(tmp_path.iterdir())


def test_new_from_a_file(tmp_path: Path, capsys) -> None:
    source = str(DATA / "asmt" / "slider_crank.asmt")
    target = tmp_path / "new.toml"
    code, out, err = run(capsys, "new", "--from", source, "--out", str(target))
    assert (code, out) == (0, "")
    assert "lengths in m" in err
    assert md.load(target).tasks
    code, _, err = run(capsys, "new", "--from", source, "--out", str(target))
    assert code == 2
    assert "exists already" in err


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ((), "a family or --from FILE is needed"),
        (("four-bar", "--from", "x.dxf"), "a family or --from FILE is needed"),
        (("--from", "x.step"), "'.step' is not read"),
        (("--from", "none.dxf"), "none.dxf: cannot be read"),
        (("--from", "none.asmt"), "none.asmt: cannot be read"),
        (("--from", "x.dxf", "--ground", "1;2"), "'1;2' is not X,Y"),
        (("four-bar", "--unit", "mm"), "only together with --from"),
        (("--from", str(DATA / "asmt" / "rssr.asmt"), "--ground", "1,2"), "ground"),
    ],
)
def test_bad_words_of_new(words, told: str, capsys) -> None:
    code, out, err = run(capsys, "new", *words)
    assert (code, out) == (2, "")
    assert told in err
