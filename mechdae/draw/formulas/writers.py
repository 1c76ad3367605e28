"""Documents as text for a terminal, as one HTML file that prints well, as Typst, as plain data."""

from __future__ import annotations

import textwrap
from base64 import b64encode
from collections.abc import Callable, Iterator
from html import escape
from typing import Any

from mechdae.draw.formulas.notations import escaped, mathml, plain, typst
from mechdae.draw.formulas.tree import (
    Column,
    Document,
    Equation,
    Facts,
    Formula,
    Grid,
    Image,
    Note,
    Number,
    Part,
    Passage,
    Section,
    Sum,
)

WIDTH = 100
"""Columns of a text."""
LISTED = 4
"""Sections from which a document has a list of them."""
SHORT = 30
"""Rows of a table that is not broken over pages."""

STYLE = """
:root { color-scheme: light; --line: #b9bec6; --faint: #5c6470; }
body { font: 16px/1.5 Georgia, "Times New Roman", "DejaVu Serif", serif; color: #15181d;
  background: #fff; max-width: 52rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0 0 .3rem; }
h2 { font-size: 1.25rem; margin: 2rem 0 .5rem; border-bottom: 1px solid var(--line); }
h3 { font-size: 1.05rem; margin: 1.4rem 0 .4rem; }
h4 { font-size: 1rem; font-style: italic; margin: 1rem 0 .3rem; }
.subtitle, figcaption, .gap { color: var(--faint); }
.formula { margin: .1rem 0 .1rem 1.5rem; padding: .25rem 0; overflow-x: auto; }
.formula math { display: inline-block; math-style: normal; }
mfrac > * { padding: .12em .1em; }
.formula, .table { overflow-x: auto; background: linear-gradient(to right, #fff 2rem, #fff0),
  linear-gradient(to left, #fff 2rem, #fff0) right, radial-gradient(farthest-side at left, #0004,
  #0000), radial-gradient(farthest-side at right, #0004, #0000) right; background-repeat: no-repeat;
  background-size: 3rem 100%, 3rem 100%, .7rem 100%, .7rem 100%;
  background-attachment: local, local, scroll, scroll; }
nav ol { columns: 2; margin: 1rem 0; padding-left: 1.5rem; } a { color: #1a5fb4; }
aside > div { display: flex; flex-wrap: wrap; gap: 0 2mm; } aside figure { flex: 0 0 87mm; }
aside img { width: 87mm !important; }
table { border-collapse: collapse; margin: .6rem 0; font-size: .92rem;
  font-variant-numeric: tabular-nums; }
th, td { border-bottom: 1px solid var(--line); padding: .15rem .6rem; text-align: right;
  white-space: nowrap; }
th:first-child, td:first-child, .words { text-align: left; }
td.words { white-space: normal; }
dl { display: grid; grid-template-columns: fit-content(22rem) 1fr; gap: .1rem 1rem;
  margin: .5rem 0; }
dt { color: var(--faint); } dd { margin: 0; }
figure { margin: 1rem 0; text-align: center; break-inside: avoid; }
figure img { height: auto; max-width: 100%; }
@media (max-width: 30rem) { dl { grid-template-columns: 1fr; } dd { margin-left: 1rem; } }
@media screen and (min-width: 76rem) { body.wide { max-width: 76rem; }
  .pictured { display: grid; grid-template-columns: minmax(0, 1fr) 92mm; column-gap: 2rem; }
  .pictured > * { grid-column: 1; } .pictured > aside { grid-column: 2; }
  aside > div { display: block; position: sticky; top: .5rem; max-height: 98vh; overflow-y: auto; }
  aside figure { margin: 0 0 .6rem; } }
@page { size: A4; margin: 20mm 16mm; }
@media print { body { margin: 0; max-width: none; font-size: 11pt; }
  nav { display: none; }
  h2, h3, h4 { break-after: avoid; } .formula, .table, tr { break-inside: avoid; }
  .formula, .table { overflow: visible; background: none; } p { orphans: 3; widows: 3; }
  p:has(+ .table) { break-after: avoid; }
  table { font-size: .84em; } th, td { padding: .15rem .3rem; }
  aside figure { margin: 0; } }
"""


# -- text --------------------------------------------------------------------------------------


def as_text(document: Document) -> str:
    """Return a document as text, at most `WIDTH` columns where lines can be broken."""
    lines = [document.title, "=" * len(document.title)]
    lines += [document.subtitle] if document.subtitle else []
    for section in document.sections:
        lines += ["", *_section_lines(section, 0)]
    return "\n".join(lines) + "\n"


def _section_lines(section: Section, depth: int) -> Iterator[str]:
    yield section.title
    yield "-~."[min(depth, 2)] * len(section.title)
    for block in section.blocks:
        yield from _block_lines(block)
    for inner in section.sections:
        yield ""
        yield from _section_lines(inner, depth + 1)


def _block_lines(block: Passage) -> Iterator[str]:
    match block:
        case Note():
            yield from textwrap.wrap(_line(block.parts), WIDTH)
        case Formula():
            yield from _formula_lines(block)
        case Facts():
            width = max((len(name) for name, _ in block.rows), default=0)
            for name, parts in block.rows:
                inner = textwrap.wrap(_line(parts), WIDTH - width - 4) or [""]
                yield f"  {name:<{width}}  {inner[0]}"
                yield from (f"  {'':<{width}}  {line}" for line in inner[1:])
        case Grid():
            yield from _table_lines(block)
        case Image():
            yield f"[{block.caption}]"


def _formula_lines(block: Formula) -> Iterator[str]:
    text = plain(block.node)
    if len(text) + 4 <= WIDTH or not isinstance(block.node, Equation):
        yield f"    {text}"
        return
    sides = [plain(side) for side in block.node.sides]
    line = f"    {sides[0]}"
    for side in sides[1:]:
        if len(line) + len(side) + 3 > WIDTH and line.strip():
            yield line
            line = " " * 6
        line += f" = {side}"
    yield from textwrap.wrap(line, WIDTH, subsequent_indent=" " * 10, break_on_hyphens=False)


def _table_lines(block: Grid) -> Iterator[str]:
    cells = [[_line((entry,)) for entry in row] for row in (block.heads, *block.rows)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    cells.insert(1, ["-" * width for width in widths])
    for first, *rest in cells:
        aligned = (f"{text:>{width}}" for text, width in zip(rest, widths[1:], strict=True))
        yield "  ".join([f"  {first:<{widths[0]}}", *aligned]).rstrip()


def _joined(
    parts: tuple[str | Part, ...], words: Callable[[str], str], formula: Callable[[Part], str]
) -> str:
    """Return words and formulas in the order of the line."""
    return "".join(words(part) if isinstance(part, str) else formula(part) for part in parts)


def _line(parts: tuple[str | Part, ...]) -> str:
    return _joined(parts, str, plain)


# -- HTML --------------------------------------------------------------------------------------


def as_html(document: Document, alone: bool = True) -> str:
    """Return a document as one HTML file without scripts or requests; the same bytes each time.

    Not `alone` it stands in a page of somebody else, such as a notebook, whose policy holds.
    """
    head = [f"<h1>{escape(document.title)}</h1>"]
    if document.subtitle:
        head.append(f'<p class="subtitle">{escape(document.subtitle)}</p>')
    head += _contents(document)
    sections = enumerate(document.sections, 1)
    body = [line for k, section in sections for line in _section_html(section, 2, f"s{k}")]
    wide = document.beside or any(section.beside for section in document.sections)
    look = ' class="wide"' if wide else ""
    policy = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"
    lines = [
        "<!doctype html>",
        f'<html lang="{escape(document.lang)}"><head><meta charset="utf-8">',
        *([f'<meta http-equiv="Content-Security-Policy" content="{policy}">'] * alone),
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{escape(document.title)}</title>",
        f"<style>{STYLE}</style></head>",
        f"<body{look}><main>",
        *head,
        *_with_pictures(body, document.beside),
        "</main></body></html>\n",
    ]
    return "\n".join(lines)


def _contents(document: Document) -> list[str]:
    """Return links to the sections, and to those in them where they are few."""
    entries: list[tuple[str, str]] = []
    few = len(document.sections) < LISTED
    for k, section in enumerate(document.sections, 1):
        entries.append((f"s{k}", section.title))
        inner = enumerate(section.sections if few else (), 1)
        entries += [(f"s{k}-{j}", f"{section.title}. {part.title}") for j, part in inner]
    links = "".join(f'<li><a href="#{mark}">{escape(title)}</a></li>' for mark, title in entries)
    return [f"<nav><ol>{links}</ol></nav>"] * (len(entries) >= LISTED)


def _with_pictures(lines: list[str], images: tuple[Image, ...]) -> list[str]:
    """Return lines of HTML beside pictures, which stay in view on a wide screen."""
    if not images:
        return lines
    figures = "".join(map(_block_html, images))
    aside = f'<aside style="grid-row: 1 / span 999"><div>{figures}</div></aside>'
    return ['<div class="pictured">', aside, *lines, "</div>"]


def _section_html(section: Section, level: int, mark: str) -> Iterator[str]:
    tag = f"h{min(level, 6)}"
    yield f'<section id="{mark}"><{tag}>{escape(section.title)}</{tag}>'
    lines = [_block_html(block) for block in section.blocks]
    for k, inner in enumerate(section.sections, 1):
        lines += _section_html(inner, level + 1, f"{mark}-{k}")
    yield from _with_pictures(lines, section.beside)
    yield "</section>"


def _block_html(block: Passage) -> str:
    match block:
        case Note():
            return f"<p>{_parts_html(block.parts)}</p>"
        case Formula():
            return f'<div class="formula">{mathml(block.node)}</div>'
        case Facts():
            rows = [f"<dt>{escape(n)}</dt><dd>{_parts_html(row)}</dd>" for n, row in block.rows]
            return f"<dl>{''.join(rows)}</dl>"
        case Grid():
            return _table_html(block)
        case Image():
            width = f"{100 * block.width:g}%"
            data = b64encode(block.svg.encode("utf-8")).decode("ascii")
            words = escape(block.caption, quote=True)
            return (
                f'<figure><img style="width:{width}" alt="{words}" '
                f'src="data:image/svg+xml;base64,{data}" />'
                f"<figcaption>{words}</figcaption></figure>"
            )
    raise TypeError(f"no HTML for {type(block).__name__}")  # pragma: no cover


def _parts_html(parts: tuple[str | Part, ...]) -> str:
    return _joined(parts, escape, mathml)


def _words(block: Grid) -> list[bool]:
    """Return which columns hold words, and not numbers or formulas."""
    return [
        any(isinstance(cell, str) and any(map(str.isalpha, cell)) for cell in column)
        for column in zip(*block.rows, strict=True)
    ] or [True] * len(block.heads)


def _table_html(block: Grid) -> str:
    marks = [' class="words"' if wordy else "" for wordy in _words(block)]

    def cells(tag: str, row: tuple[str | Part, ...]) -> str:
        pairs = zip(marks, row, strict=True)
        return "".join(f"<{tag}{mark}>{_parts_html((cell,))}</{tag}>" for mark, cell in pairs)

    heads = cells("th", block.heads)
    rows = "".join(f"<tr>{cells('td', row)}</tr>" for row in block.rows)
    return (
        f'<div class="table"><table><thead><tr>{heads}</tr></thead>'
        f"<tbody>{rows}</tbody></table></div>"
    )


# -- Typst -------------------------------------------------------------------------------------


def as_typst(document: Document) -> str:
    """Return a document in the markup of Typst; pictures stand in it as SVG text."""
    lines = [
        f'#set document(title: "{_string(document.title)}", date: none)',
        '#set page(paper: "a4", margin: (x: 16mm, y: 20mm), numbering: "1")',
        f'#set text(lang: "{document.lang}", size: 11pt)',
        "#set table(stroke: 0.4pt + luma(190), inset: 4pt)",
        "#show table: set text(size: 9pt)",
        "",
        f"#align(center, text(size: 18pt, weight: 700)[{escaped(document.title)}])",
    ]
    if document.subtitle:
        lines.append(f"#align(center, text(fill: luma(90))[{escaped(document.subtitle)}])")
    lines += _pictures_typst(document.beside)
    for section in document.sections:
        lines += ["", *_section_typst(section, 1)]
    return "\n".join(lines) + "\n"


def _section_typst(section: Section, level: int) -> Iterator[str]:
    yield f"{'=' * min(level, 5)} {escaped(section.title)}"
    yield from _pictures_typst(section.beside)
    for block in section.blocks:
        yield ""
        yield _block_typst(block)
    for inner in section.sections:
        yield ""
        yield from _section_typst(inner, level + 1)


def _pictures_typst(images: tuple[Image, ...]) -> Iterator[str]:
    """Yield pictures two in a line."""
    if images:
        cells = ", ".join(f"[{_block_typst(image)}]" for image in images)
        yield f"#grid(columns: (1fr, 1fr), gutter: 4mm, {cells})"


def _block_typst(block: Passage) -> str:
    match block:
        case Note():
            return _parts_typst(block.parts)
        case Formula():
            return typst(block.node, block=True)
        case Facts():
            rows = [f"  [{escaped(n)}], [{_parts_typst(row)}],\n" for n, row in block.rows]
            return f"#table(columns: (auto, 1fr), stroke: none,\n{''.join(rows)})"
        case Grid():
            return _table_typst(block)
        case Image():
            svg = _string(block.svg)
            width = f"{100 * block.width:g}%"
            return (
                f'#figure(image(bytes("{svg}"), format: "svg", width: {width}), '
                f"caption: [{escaped(block.caption)}])"
            )
    raise TypeError(f"no Typst for {type(block).__name__}")  # pragma: no cover


def _table_typst(block: Grid) -> str:
    """Return a table that stays on one page where it fits, its heads again on each other page."""

    def cells(row: tuple[str | Part, ...]) -> str:
        return ", ".join(f"[{_parts_typst((entry,))}]" for entry in row)

    rows = "".join(f"  {cells(row)},\n" for row in block.rows)
    words = _words(block)
    align = ", ".join("left" if k == 0 or wordy else "right" for k, wordy in enumerate(words))
    table = (
        f"#table(columns: {len(block.heads)}, align: ({align}),\n"
        f"  table.header({cells(block.heads)}),\n{rows})"
    )
    return f"#block(breakable: false)[{table}]" if len(block.rows) <= SHORT else table


def _parts_typst(parts: tuple[str | Part, ...]) -> str:
    return _joined(parts, escaped, typst)


def _string(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")


# -- plain data --------------------------------------------------------------------------------


def as_data(document: Document) -> dict[str, object]:
    """Return a document as what JSON can hold: formulas as text, their printed numbers beside."""
    return {
        "title": document.title,
        "subtitle": document.subtitle,
        "lang": document.lang,
        "sections": [_section_data(section) for section in document.sections],
    }


def _section_data(section: Section) -> dict[str, object]:
    blocks, sections = map(_block_data, section.blocks), map(_section_data, section.sections)
    return {"title": section.title, "blocks": [*blocks], "sections": [*sections]}


def _block_data(block: Passage) -> dict[str, object]:
    match block:
        case Note():
            return {"note": _line(block.parts)}
        case Formula():
            found: dict[str, object] = {"formula": plain(block.node)}
            if isinstance(block.node, Equation):
                found["sides"] = [_numbers_of(side) for side in block.node.sides]
            if block.gap is not None:
                found |= {"gap": block.gap, "unit": block.unit}
            return found
        case Facts():
            return {"facts": {name: _line(parts) for name, parts in block.rows}}
        case Grid():
            rows = [[_line((entry,)) for entry in row] for row in (block.heads, *block.rows)]
            return {"heads": rows[0], "rows": rows[1:]}
        case Image():
            return {"picture": block.caption}
    raise TypeError(f"no data of {type(block).__name__}")  # pragma: no cover


def _numbers_of(node: Part) -> Any:
    """Return the printed numbers of one side of an equation, None for letters."""
    match node:
        case Number():
            return node.value
        case Column():
            return list(node.values)
        case Sum():
            return [_numbers_of(term) for term in node.terms]
    return None
