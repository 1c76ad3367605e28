"""The command line: parse, import what the subcommand uses, print, return an exit code.

0 done; 1 computed, but the answer has a fault; 2 bad usage or bad file.
"""

from __future__ import annotations

import argparse
import gc
import sys
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext, redirect_stdout
from typing import TextIO, cast

from mechdae import __version__
from mechdae.additions import Added, Registry
from mechdae.errors import MechdaeError
from mechdae.kernels.machine.library import backend

_PLAIN = {
    "list": "the predefined problems",
    "show": "structure of a problem: groups, mobility, what its tasks build",
    "check": "validate files and verify the values they expect",
    "solve": "run the tasks of a problem",
    "plot": "pictures of a problem",
    "synthesize": "dimensions that do what a task asks for",
    "study": "one task for many sets of numbers",
    "sensitivity": "derivatives by parameters, tolerances",
    "modules": "the catalogue of vector modules",
    "cache": "kernels kept on disk",
    "schema": "JSON Schema of the problem file",
}
COMMANDS: Registry[Added] = Registry(
    "commands",
    {name: Added(f"mechdae.cli.commands.{name}", about=about) for name, about in _PLAIN.items()},
    lambda added: added,
)
"""The commands, with what each is for; those of parts add themselves."""


class _Version(argparse.Action):
    """Prints the version, and what evaluates kernels."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        try:
            print(f"mechdae {__version__} (back end: {backend()})")
        except MechdaeError as error:
            parser.exit(2, f"mechdae: {error}\n")
        parser.exit()


COLLECTED = 100_000
"""New objects after which a command looks for garbage; importing a solver makes 60 000."""


def console() -> int:
    """Run the command of a process of its own, which does not tidy up what ends with it."""
    gc.set_threshold(COLLECTED)
    try:
        return main()
    finally:
        gc.freeze()


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    words = list(sys.argv[1:] if argv is None else argv)
    parser = argparse.ArgumentParser(
        prog="mechdae", description="Mechanisms from symbolic constraints.", allow_abbrev=False
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="version and back end")
    commands = parser.add_subparsers(dest="command", metavar="command", required=True)
    named = next((word for word in words if not word.startswith("-")), None)
    known = COMMANDS.whole() if named is None or named not in COMMANDS else [named]
    for name in known:  # one says nothing of the others
        entry = COMMANDS[name]
        command = commands.add_parser(
            name, help=entry.about, description=entry.about, allow_abbrev=False
        )
        command.add_argument("--quiet", action="store_true", help="no messages, only results")
        command.add_argument("--debug", action="store_true", help="tracebacks of errors")
        if name == named:
            chosen = entry.load()
            chosen.arguments(command)
    try:
        arguments = parser.parse_args(_with_labels(words))
    except SystemExit as stop:
        from mechdae.cli.failures import refused

        return refused(words, int(stop.code or 0))
    try:
        with _output(arguments):
            code = int(chosen.run(arguments))
            sys.stdout.flush()
            return code
    except (MechdaeError, OSError, KeyboardInterrupt) as error:
        from mechdae.cli.failures import failure

        return failure(error, arguments)


def _output(arguments: argparse.Namespace) -> AbstractContextManager[object]:
    """Let text fit the terminal, and a command go on that writes files too.

    These are wanted although nobody reads on.
    """
    stream = sys.stdout
    if getattr(arguments, "out", None) is not None:
        from mechdae.cli.failures import Unread

        stream = cast("TextIO", Unread(stream))
    if stream.isatty():
        from mechdae.cli.terminal import Terminal, is_text, width_of

        if is_text(arguments):
            stream = cast("TextIO", Terminal(stream, width_of(stream)))
    return nullcontext() if stream is sys.stdout else redirect_stdout(stream)


def _with_labels(words: list[str]) -> list[str]:
    """Return the words with ``--mode -,+2`` as one: the label looks like an option."""
    joined: list[str] = []
    for word in words:
        if (
            joined
            and joined[-1] == "--mode"
            and word[:1] == "-"
            and not word.strip("+-,:0123456789")
        ):
            joined[-1] = f"--mode={word}"
        else:
            joined.append(word)
    return joined


def message(text: str, quiet: bool) -> None:
    """Print a message to stderr."""
    if not quiet:
        if sys.stderr.isatty():
            from mechdae.cli.terminal import said

            text = said(text, sys.stderr)
        print(text, file=sys.stderr)
