"""Files of results are there whole or not at all, and errors name them."""

from __future__ import annotations

import os

import pytest

from mechdae.describe.file.atomic_write import whole_file
from tests.shared.command import run


def test_a_full_disk_names_the_file_and_leaves_what_was_there(tmp_path) -> None:
    path = tmp_path / "turn.csv"
    path.write_text("before")

    def write() -> None:
        with whole_file(path) as file:
            file.write(b"half")
            raise OSError(28, os.strerror(28))

    with pytest.raises(OSError, match="No space left") as caught:
        write()
    assert caught.value.filename == str(path)
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is always full")
def test_the_command_names_the_file_that_cannot_be_written(capsys, tmp_path) -> None:
    (tmp_path / "turn.csv.part").symlink_to("/dev/full")
    words = ("slider-crank", "--task", "turn", "--poses", "500", "--out", str(tmp_path))
    code, _, err = run(capsys, "solve", *words)
    assert code == 2
    assert f"{tmp_path}/turn.csv: No space left on device" in err


@pytest.mark.parametrize("words", [("page", "four-bar-crank-rocker"), ("edit",)])
def test_a_folder_is_no_file(words, capsys, tmp_path) -> None:
    code, _, err = run(capsys, *words, "--out", str(tmp_path))
    assert code == 2
    assert "is a folder, not a file" in err
    assert not list(tmp_path.iterdir()) + list(tmp_path.parent.glob("*.part"))
