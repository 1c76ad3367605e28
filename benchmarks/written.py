"""What scripts of benchmarks share: figures and tables that they write, closed forms in C."""

from __future__ import annotations

import argparse
import ctypes
import json
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

COMPILER = shutil.which("cc") or shutil.which("gcc")


def arguments(parser: argparse.ArgumentParser) -> None:
    """Add where figures and table go."""
    parser.add_argument("--out", type=Path)
    parser.add_argument("--page", type=Path)


def written(
    options: argparse.Namespace, records: list[dict[str, Any]], table: str, begin: str, end: str
) -> None:
    """Print a table and write it between two marks of a page, the figures as JSON."""
    print(table)
    if options.out:
        options.out.write_text(json.dumps(records, indent=1) + "\n", encoding="utf-8")
    if options.page:
        head, rest = options.page.read_text(encoding="utf-8").split(begin)
        tail = rest.split(end)[1]
        whole = f"{head}{begin}\n\n{table}\n\n{end}{tail}"
        options.page.write_text(whole, encoding="utf-8")


@cache
def c_library(source: Path) -> Any:
    """Return a library of C, None without a compiler."""
    if COMPILER is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / f"{source.stem}.so"
        flags = ["-O3", "-march=native", "-shared", "-fPIC"]
        command = [COMPILER, *flags, str(source), "-o", str(library), "-lm"]
        subprocess.run(command, capture_output=True, check=True)
        return ctypes.CDLL(str(library))
