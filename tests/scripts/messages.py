"""Messages to users before and after a change: of changed files, and of all that tests refuse.

    python -m tests.scripts.messages mutated FILE --count 5000
    python -m pytest -p tests.scripts.messages --messages FILE
    python -m tests.scripts.messages compare BEFORE AFTER

The first reads files as `tests.attack.mutations` changes them. The second runs those tests that
expect an error or call the command line, and keeps what is raised and what is written to the
terminal as an error. Both write a line of JSON for each message. Another version of the package is
used by PYTHONSAFEPATH=1 PYTHONPATH=OTHER:THIS.
"""

from __future__ import annotations

import argparse
import functools
import inspect
import json
import re
import sys
import tempfile
import warnings
from collections import Counter, defaultdict
from pathlib import Path
from typing import Any

import pytest

CALLS = re.compile(r"raises\(|main\(|\brun\(|refus|\.main\b|reject|told\(")
"""A test that may see a message has one of these in its source."""
RAN: list[str] = [""]
"""The test that runs."""


def line(file: Path, case: str, message: str) -> None:
    with file.open("a", encoding="utf-8") as out:
        out.write(json.dumps([case, message], ensure_ascii=False) + "\n")


# -- while tests run -------------------------------------------------------------------------------


def pytest_addoption(parser: Any) -> None:
    parser.addoption("--messages", type=Path, required=True)


def pytest_configure(config: Any) -> None:
    import mechdae.cli

    out, kind = config.option.messages.resolve(), type(pytest.raises(SystemExit))
    left, called = kind.__exit__, mechdae.cli.main

    def leave(self: Any, raised: Any, error: Any, trace: Any) -> Any:
        if raised is not None and raised.__module__.startswith("mechdae"):
            line(out, RAN[0], f"{raised.__name__}: {error}")
        return left(self, raised, error, trace)

    @functools.wraps(called)
    def main(*arguments: Any) -> Any:
        terminal, text = sys.stderr, []

        class Both:
            def write(self, part: str) -> int:
                text.append(part)
                return terminal.write(part)

            def __getattr__(self, name: str) -> Any:
                return getattr(terminal, name)

        sys.stderr = Both()
        code: Any = "left"
        try:
            code = called(*arguments)
        finally:
            sys.stderr = terminal
            written = "".join(text).split("\r")[-1]
            line(out, RAN[0], f"exit code {code}: {written}")
        return code

    kind.__exit__ = leave
    mechdae.cli.main = main


def pytest_collection_modifyitems(items: list[Any]) -> None:
    items[:] = [item for item in items if CALLS.search(inspect.getsource(item.function))]


def pytest_runtest_setup(item: Any) -> None:
    RAN[0] = item.nodeid.rsplit("/", 1)[-1]


# -- changed files ---------------------------------------------------------------------------------


def mutated(file: Path, seeds: range) -> None:
    """Read changed files, without computing anything; keep what is said of each."""
    import mechdae as md
    from tests.attack.mutations import bases, case

    tables = bases()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "problem.toml"
        for seed in seeds:
            name, text, changes, _ = case(seed, tables)
            path.write_text(text, encoding="utf-8")
            said = ""
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("error")
                    md.load(path)
            except md.MechdaeError as error:
                said = f"{type(error).__name__}: {error}".replace(str(path), "FILE")
            line(file, f"{seed} {name}: {', '.join(changes)}", said)


# -- comparison ------------------------------------------------------------------------------------


def messages(file: Path) -> dict[str, Counter[str]]:
    """Return the messages of each case; places of files and times do not count."""
    read: dict[str, Counter[str]] = defaultdict(Counter)
    for text in file.read_text(encoding="utf-8").splitlines():
        case, message = json.loads(text)
        message = re.sub(
            r"\S*/(?:pytest-of-\w+/pytest-\d+|tmp\w*)(?:/popen-gw\d+)?", "TMP", message
        )
        read[case][re.sub(r"\d+(\.\d+)? m?s\b", "TIME", message)] += 1
    return read


def compare(before: Path, after: Path) -> int:
    old, new = messages(before), messages(after)
    differ = 0
    for case in old:
        if case not in new:
            continue
        gone, come = old[case] - new[case], new[case] - old[case]
        if gone or come:
            differ += 1
            print(f"{case}")
            for sign, texts in (("-", gone), ("+", come)):
                for text in texts.elements():
                    print(f"  {sign} {text.rstrip()}")
    print(
        f"{len(old)} cases before, {len(new)} after, {len(old.keys() - new.keys())} gone, "
        f"{differ} differ, {sum(sum(texts.values()) for texts in old.values())} messages before"
    )
    return int(bool(differ))


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("mutated")
    one.add_argument("file", type=Path)
    one.add_argument("--count", type=int, default=5000)
    two = commands.add_parser("compare")
    two.add_argument("before", type=Path)
    two.add_argument("after", type=Path)
    options = parser.parse_args(arguments)
    if options.command == "compare":
        return compare(options.before, options.after)
    mutated(options.file, range(options.count))
    return 0


if __name__ == "__main__":
    sys.exit(main())
