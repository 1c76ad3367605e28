"""Builds the documentation site: ``python docs/make_site.py --out DIR``.

Everything is made from the repository: its pages, the docstrings, the predefined problems, which
are solved and drawn. Nothing is fetched, warnings are errors, ``DIR`` is replaced as a whole when
the site is complete.
"""

from __future__ import annotations

import argparse
import contextlib
import html
import io
import re
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from urllib.parse import unquote

from website import api, cards, problems, stage

MARK = "objects.inv"
FETCHED = re.compile(
    r"""<(?:script|img|iframe|source|video|audio|embed)\b[^>]*\bsrc=["']?(?:https?:)?//"""
    r"""|<link\b(?=[^>]*\brel=["']?(?:stylesheet|preload|icon|modulepreload|preconnect))[^>]*"""
    r"""\bhref=["']?(?:https?:)?//|@import\s+(?:url\()?["']?(?:https?:)?//|url\(["']?https?://""",
    re.I,
)
"""What makes a browser ask another host for something when a page is opened."""
NAMED = re.compile(r'<[^>]*\b(?:href|src)="([^"#:?]+)[^":]*"')
"""A file of the site that a page names."""


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
        report = "\n".join(faults(built))
        if report:
            print(report, file=sys.stderr)
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
    stage.contents(source, generated, cards.home(source / "_live/live"))
    settings(source)


def settings(source: Path) -> None:
    """Write what Sphinx and browsers need, and pages by their former names."""
    folder = Path(__file__).parent / "website"
    for name in ("conf.py", "scorer.js"):
        shutil.copyfile(folder / name, source / name)
    shutil.copytree(folder / "static", source / "_static")
    stage.redirects(source / "_live")


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


def faults(built: Path) -> Iterator[str]:
    """Yield what files of a site would ask other hosts for, and names of files that are none."""
    for path in sorted([*built.glob("**/*.html"), *built.glob("**/*.css")]):
        text, name = path.read_text(encoding="utf-8"), path.relative_to(built)
        match = FETCHED.search(text)
        if match:
            yield f"{name} asks another host: {match.group(0)[:80]}"
        for link in NAMED.findall(text) if path.suffix == ".html" else []:
            if not (path.parent / unquote(html.unescape(link))).exists():
                yield f"{name} names what is not there: {link}"


if __name__ == "__main__":
    sys.exit(main())
