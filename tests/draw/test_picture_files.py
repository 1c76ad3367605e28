"""Files of pictures: kinds and formats, the same bytes each time."""

from __future__ import annotations

import subprocess
import sys

import pytest

import mechdae as md
from mechdae.cli import main
from mechdae.draw import save
from tests.shared.drawn import (
    seven_link,
    with_gid,
)


def test_dark_alone_draws_the_diagram_of_reactions(tmp_path, capsys):
    command = ["plot", "quick-return-friction", "--out", str(tmp_path)]
    assert main([*command, "--dark", "--lang", "ru"]) == 0
    assert capsys.readouterr().out.strip().endswith("-diagram.svg")
    assert main([*command, "--dark", "--kind", "curves"]) == 2


def test_letters_are_outlines_in_svg_files_and_text_elsewhere(tmp_path):
    axes = md.plot(seven_link())
    (letter,) = with_gid(axes, "label-crank.A")
    assert letter.get_text() == "A"
    outlines = save(axes, tmp_path / "a.svg").read_text()
    part = outlines.split('id="label-crank.A"')[1].split("</g>")[0]
    assert "<path" in part
    assert "<use" not in part
    letter.set_rotation(30.0)
    part = save(axes, tmp_path / "b.svg").read_text().split('id="label-crank.A"')[1]
    assert "rotate(-30" in part.split("</g>")[0]


def test_unknown_kinds():
    with pytest.raises(md.UnavailableError, match=r"md\.page"):
        md.plot(None, "page")
    with pytest.raises(md.UnknownName, match="diagram"):
        md.plot(None, "diagramm")


@pytest.mark.parametrize("ending", ["svg", "png", "pdf"])
def test_files_are_the_same_each_time(tmp_path, ending):
    first = save(md.plot(seven_link()), tmp_path / f"a.{ending}")
    second = save(md.plot(seven_link()).get_figure(), tmp_path / f"b.{ending}")
    assert first.read_bytes() == second.read_bytes()
    assert len(list(tmp_path.iterdir())) == 2


def test_unknown_format_leaves_nothing(tmp_path):
    with pytest.raises(md.InputError, match="docx"):
        save(md.plot(seven_link()), tmp_path / "a.docx")
    assert not list(tmp_path.iterdir())


def test_no_pyplot_and_lazy_import():
    code = (
        "import sys, mechdae.draw; assert 'matplotlib' not in sys.modules;"
        "import mechdae.draw.diagram.diagram; assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_letters_of_an_svg_are_outlines_or_text(tmp_path):
    axes = md.plot("four-bar-crank-rocker")
    outlines, text = (
        save(axes, tmp_path / f"{written}.svg", text=written).read_text(encoding="utf-8")
        for written in (False, True)
    )
    assert "<text" not in outlines
    assert text.count("<text") > 5
    assert "Four-bar" in text.split("<defs>", 1)[1]
    for svg in (outlines, text):
        assert "<title>Four-bar" in svg
        assert "<desc>" in svg
