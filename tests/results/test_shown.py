"""How results and problems are shown: printed, in a cell, by what completes names."""

from __future__ import annotations

import re
import sys

import pytest

import mechdae as md
from mechdae.errors import nearest


@pytest.fixture(scope="module")
def result():
    return md.solve("slider-crank", "turn")


def test_printed_it_is_what_the_command_prints(result, capsys):
    from mechdae.cli import main

    assert main(["solve", "slider-crank", "--task", "turn", "--quiet"]) == 0
    assert str(result) == capsys.readouterr().out.strip()
    assert repr(result) == "<SweepResult slider-crank / turn: 361 ok>"


def test_cells_escape_what_files_say():
    problem = md.load("slider-crank")
    evil = "<script>alert(1)</script>"
    problem = md.Problem(problem.mechanism, problem.tasks, name="x", title=evil)
    shown = md.solve(problem, "turn")._repr_html_() + problem._repr_html_()
    assert "<script" not in shown
    assert shown.count("&lt;script&gt;") == 2


def test_a_cell_has_seven_rows_and_a_picture(result):
    shown = result._repr_html_()
    assert shown.count("<tr>") == 8
    assert 'src="data:image/svg+xml;base64,' in shown


def test_a_study_is_shown_as_its_text():
    shown = md.solve("slider-crank", "modes")._repr_html_()
    assert "<pre>" in shown
    assert "assembly mode" in shown


def test_names_complete(result):
    assert {"angle", "angular_velocity"} <= set(dir(result.bodies["rod"]))
    assert result.bodies._ipython_key_completions_() == list(result.bodies)
    assert result.bodies["rod"]._ipython_key_completions_() == list(result.bodies["rod"])


def test_the_last_word_of_a_name_is_enough_for_the_answer(result):
    with pytest.raises(md.UnknownName, match=r"did you mean rod.C or slider.C\?"):
        result.points["C"]
    assert nearest("P", ["coupler.P", *(f"link{k}.A{k}" for k in range(9))])[0] == "coupler.P"


def test_a_frame_is_the_table_of_the_file(result, monkeypatch):
    class Pandas:
        @staticmethod
        def DataFrame(table, index):
            assert index == result.drivers["crank.angle"].position.tolist()
            return table

        @staticmethod
        def Index(values, name):
            assert name == "crank.angle [rad]"
            return values.tolist()

    monkeypatch.setitem(sys.modules, "pandas", Pandas)
    from mechdae.tasks.export import csv_text

    frame = result.frame()
    head = csv_text(result).splitlines()[0].split(",")
    assert list(frame) == head
    assert frame["crank.angle.position [rad]"][90] == result.drivers["crank.angle"].position[90]
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(md.UnavailableError, match="pip install pandas"):
        result.frame()


def test_a_problem_is_a_screen():
    lines = str(md.load("gorshkov-seven-link")).splitlines()
    assert len(lines) < 40
    assert max(map(len, lines)) <= 120
    assert any(re.match(r"  window: sweep, driven by crank.angle", line) for line in lines)
    every = str(md.load("five-crank-parallelogram")).splitlines()
    assert len(every) < 100
