"""Writes the sizes of letters that pictures are laid out with, from the fonts that draw them.

python docs/make_letters.py
"""

from __future__ import annotations

import json
from pathlib import Path

from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.textpath import TextPath

from mechdae.draw import style
from mechdae.draw.fonts import TABLE, face_of, font

RANGES = ((0x20, 0x7F), (0xB0, 0xB8), (0x391, 0x3CA), (0x410, 0x450))
OTHERS = "×…−–—→↔≤≥≈∞²³′″·µ°"
FACES = (font(1.0), font(1.0, style="italic"), font(1.0, style.NOTE_FONT))
SIZE = 100.0


def main() -> None:
    letters = sorted({*(chr(c) for low, high in RANGES for c in range(low, high)), *OTHERS})
    table = {}
    for face in FACES:
        prop = FontProperties(family=list(face.families), size=SIZE, style=face.style)
        drawn = [get_font(findfont(FontProperties(family=name, style=face.style)))
                 for name in face.families]  # fmt: skip
        rows = {}
        for letter in letters:
            found = next((source for source in drawn if source.get_char_index(ord(letter))), None)
            if found is None:
                continue
            both = TextPath((0.0, 0.0), f"{letter}|".replace("$", r"\$"), prop=prop).get_extents()
            bar = TextPath((0.0, 0.0), "|", prop=prop).get_extents()
            ink = [0.0] * 4
            if letter.strip():
                box = TextPath((0.0, 0.0), letter.replace("$", r"\$"), prop=prop).get_extents()
                ink = [box.x0, box.y0, box.x1, box.y1]
            step = both.x1 - bar.x1
            rows[letter] = [round(value / SIZE, 4) for value in (step, *ink)]
        table[face_of(face)] = rows
    text = json.dumps(table, ensure_ascii=False, separators=(",", ":"))
    Path(TABLE).write_text(text.replace("]},", "]},\n") + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
