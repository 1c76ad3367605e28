"""The command line, called as a function."""

from __future__ import annotations

from mechdae.cli import main


def run(capsys, *words: str) -> tuple[int, str, str]:
    code = main(list(words))
    out = capsys.readouterr()
    assert "Traceback" not in out.err
    return code, out.out, out.err
