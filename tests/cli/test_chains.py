"""``mechdae chains``: counts, JSON, files, what it refuses."""

from __future__ import annotations

import json

import pytest

from tests.shared.command import run


def test_json_of_chains_is_one_object(capsys) -> None:
    code, out, _ = run(capsys, "chains", "--links", "6", "--drivers", "--formula", "--json")
    data = json.loads(out)
    assert code == 0
    assert (data["links"], data["freedoms"], data["count"], len(data["chains"])) == (6, 1, 9, 9)
    for chain in data["chains"]:
        assert chain["fixed"] in chain["joints"][chain["driver"]]
        assert chain["formula"].startswith("I(")
        assert len(chain["joints"]) == 7


def test_counts_have_no_list(capsys) -> None:
    _, out, _ = run(capsys, "chains", "--links", "8", "--pairs", "--count", "--json")
    assert json.loads(out) == {"links": 8, "freedoms": 1, "count": 7185}
    assert run(capsys, "chains", "--links", "4", "--groups", "--count")[1] == "2\n"


def test_long_lists_say_how_many_are_not_shown(capsys) -> None:
    lines = run(capsys, "chains", "--links", "8", "--pairs")[1].splitlines()
    assert lines[-1] == "7185 in all, 7145 not shown: --json, --out"
    assert len(lines) == 41


def test_chains_are_written_and_drawn(capsys, tmp_path) -> None:
    for name in ("chains.json", "chains.svg"):
        assert run(capsys, "chains", "--links", "6", "--out", str(tmp_path / name))[0] == 0
    assert len(json.loads((tmp_path / "chains.json").read_text())["chains"]) == 2
    assert (tmp_path / "chains.svg").read_text().startswith("<?xml")
    code, _, err = run(capsys, "chains", "--links", "6", "--out", str(tmp_path / "chains.svg"))
    assert code == 2
    assert "exists already" in err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--links 7", "6 or 8 links"),
        ("--links 16", "more than are listed"),
        ("--links 6 --freedoms 7", "0 to 3"),
        ("--links 6 --groups --pairs", "no --pairs"),
        ("--links 6 --formula", "--drivers"),
        ("--links 6 --out list.txt", "cannot write '.txt'"),
        ("--links 6 --out no/such/folder.json", "no such folder"),
        ("--links 8 --pairs --out many.svg", "do not fit"),
        ("--links six", "invalid int value"),
    ],
)
def test_bad_usage(capsys, words: str, said: str) -> None:
    code, _, err = run(capsys, "chains", *words.split())
    assert code == 2
    assert said in err
