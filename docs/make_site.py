"""Builds the documentation site: ``python docs/make_site.py --out DIR``.

Everything is made from the repository: its pages, the docstrings, the predefined problems, which
are solved and drawn. Nothing is fetched, warnings are errors, ``DIR`` is replaced as a whole when
the site is complete.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import re
import shutil
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from website import api, problems, stage

MARK = "objects.inv"
FETCHED = re.compile(
    r"""<(?:script|img|iframe|source|video|audio|embed)\b[^>]*\bsrc=["']?(?:https?:)?//"""
    r"""|<link\b(?=[^>]*\brel=["']?(?:stylesheet|preload|icon|modulepreload|preconnect))[^>]*"""
    r"""\bhref=["']?(?:https?:)?//|@import\s+(?:url\()?["']?(?:https?:)?//|url\(["']?https?://""",
    re.I,
)
"""What makes a browser ask another host for something when a page is opened."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    parser = argparse.ArgumentParser(description=__doc__.split(":")[0])
    parser.add_argument("--out", type=Path, required=True, help="folder of the site, replaced")
    options = parser.parse_args(argv)
    start = time.perf_counter()
    fault = _refusal(options.out)
    if fault:
        print(fault, file=sys.stderr)
        return 2
    options.out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=options.out.parent, prefix=".site-") as folder:
        source, built = Path(folder, "source"), Path(folder, "html")
        generate(source)
        report = build(source, built, Path(folder, "trees"))
        if report:
            print(report, file=sys.stderr)
            return 1
        asked = fetched(built)
        if asked:
            print("asks other hosts: " + "; ".join(asked), file=sys.stderr)
            return 1
        if options.out.exists():
            shutil.rmtree(options.out)
        built.rename(options.out)
    pages = sum(1 for _ in options.out.glob("**/*.html"))
    seconds = time.perf_counter() - start
    print(f"{options.out}: {pages} pages in {seconds:.0f} s")
    return 0


def _refusal(out: Path) -> str | None:
    """Return why a folder is not written, or None."""
    try:
        import furo  # noqa: F401
        import myst_parser  # noqa: F401
        import sphinx  # noqa: F401
    except ModuleNotFoundError as error:
        return f'the site needs {error.name}: pip install "mechdae[docs]"'
    if out.exists() and not out.is_dir():
        return f"{out} is a file; --out names a folder"
    if out.exists() and any(out.iterdir()) and not (out / MARK).exists():
        return f"{out} holds something that is no site of an earlier run; nothing was written"
    return None


def generate(source: Path) -> None:
    """Write all sources of the site."""
    stage.stage(source)
    generated = {"Reference": [*problems.write(source), *api.write(source)]}
    folder = Path(__file__).parent / "website"
    shutil.copyfile(folder / "conf.py", source / "conf.py")
    shutil.copytree(folder / "static", source / "_static")
    (source / "_live").mkdir(exist_ok=True)
    stage.redirects(source / "_live")
    stage.contents(source, generated)


def build(source: Path, built: Path, trees: Path) -> str | None:
    """Run Sphinx with warnings as errors; return what it complained about, or None."""
    from sphinx.application import Sphinx

    said = io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()):
        app = Sphinx(
            source, source, built, trees, "html", status=None, warning=said, parallel=2,
            freshenv=True,
        )  # fmt: skip
        app.build()
    if app.statuscode or app._warncount:
        return said.getvalue() or "Sphinx failed"
    shutil.rmtree(built / ".doctrees", ignore_errors=True)
    return None


def fetched(built: Path) -> list[str]:
    """Return the files of a site that would ask other hosts for something."""
    found = []
    for path in sorted([*built.glob("**/*.html"), *built.glob("**/*.css")]):
        match = FETCHED.search(path.read_text(encoding="utf-8"))
        if match:
            found.append(f"{path.relative_to(built)}: {match.group(0)[:80]}")
    return found


if __name__ == "__main__":
    sys.exit(main())
