"""The explanation of the pose of article 000, with the article's numbers beside its vectors."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from article_seven_link import PRINTED, Row, pose, quantities
from article_text import percent, sign, table, verdict

import mechdae as md

BESIDE = {
    "v_A": "vA", "v_A3": "vA3", "v^r_A3A": "vSlide", "a_A": "aA", "a_A3": "aA3",
    "a^k_A3A": "aCor", "a^r_A3A": "a32r", "a^n_A3G": "aA3n", "a^τ_A3G": "aA3t",
    "v_B": "vB", "v_C": "vC", "v_CB": "vCB", "a_B": "aB", "a_C": "aC", "a^n_CB": "aCBn",
    "a^τ_CB": "aCBt", "v_E": "vE", "v_EB": "vEB", "a_E": "aE", "a^n_EB": "aEBn",
    "a^τ_EB": "aEBt", "a^n_EF": "aEFn", "a^τ_EF": "aEFt", "|ω_3|": "w3", "|ε_3|": "e3",
    "|ω_4|": "w4", "|ω_6|": "w6", "|ω_7|": "w7",
}  # fmt: skip
"""Symbol of the explanation -> key of the article's quantity, both magnitudes."""
ARTICLE = "article | % | drawn | % | verdict"
PARTS = ("Positions", "Velocities", "Accelerations")


def rows_of(key: str) -> list[Row]:
    """Return what the article prints for a quantity."""
    return [row for rows in PRINTED.values() for row in rows if row.key == key]


def beside(symbol: str, *cells: str) -> list[list[str]]:
    """Return the rows of one vector: what the explanation has, and each print of the article."""
    key = BESIDE.get(symbol)
    true = quantities(pose())[key] if key else 0.0
    found: list[list[str]] = []
    symbol = symbol.strip("|")
    for k, row in enumerate(rows_of(key) if key else []):
        judged = verdict(row.printed, true)
        found.append(
            [
                *([symbol, *cells] if k == 0 else ["″"] * (1 + len(cells))),
                sign(row.printed),
                percent(float(row.printed), true),
                row.drawn or "–",
                percent(float(row.drawn), true) if row.drawn else "–",
                f"{judged}: {row.why}" if row.why else judged,
            ]
        )
    return found or [[symbol, *cells, "–", "–", "–", "–", "–"]]


def blocks(section: dict[str, Any]) -> Iterator[list[str]]:
    """Yield the lines of each vector equation of a section, with the article beside."""
    heads = "vector | size | angle with x | x | y | direction"
    pending: list[str] = []
    for block in section["blocks"]:
        if "rows" in block:
            body = [line for row in block["rows"] for line in beside(*row)]
            yield [*_code(pending), *table(f"{heads} | {ARTICLE}", body)]
            pending = []
        elif "formula" in block:
            symbol, size = block["formula"].split(" = ")[0], block["formula"].split(" = ")[-1]
            if symbol.startswith("|") and symbol in BESIDE:
                code = _code([*pending, block["formula"]])
                yield [*code, *table(f"rate | value | {ARTICLE}", beside(symbol, size))]
                pending = []
            else:
                pending.append(block["formula"])
    if pending:
        yield _code(pending)


def _code(formulas: list[str]) -> list[str]:
    return ["```text", *formulas, "```", ""] if formulas else []


def lines() -> list[str]:
    """Return the section of the page."""
    found = [
        "### The explanation beside the article",
        "",
        "What `mechdae explain gorshkov-seven-link` writes of groups 2-3, 4-5 and 6-7, and beside "
        "each vector what the article prints and draws. Signs are in the equations; the "
        "article has magnitudes.",
        "",
    ]
    for section in md.explain(pose()).data()["sections"]:
        parts = [own for own in section["sections"] if own["title"] in PARTS]
        if not parts or "II" not in section["title"]:
            continue
        for part in parts:
            found += [f"**{section['title']}, {part['title'].lower()}**", ""]
            for block in blocks(part):
                found += block
    return found
