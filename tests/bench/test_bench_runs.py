"""Rows of measurements tell their run, and are written as they come."""

from __future__ import annotations

import importlib.util
import json

from mechdae.parts.bench.runs import STAMP, BenchRun
from tests.shared.paths import ROOT


def test_rows_are_written_as_they_come_with_their_run(tmp_path) -> None:
    path = tmp_path / "out" / "bench.json"
    run = BenchRun(path)
    first = run.add([{"work": "a", "n": 1}])
    assert json.loads(path.read_text()) == first
    second = run.add([{"work": "b", "n": 2}, {"work": "c", "n": 3}])
    assert json.loads(path.read_text()) == [*first, *second]
    for row in [*first, *second]:
        assert set(row) == {"work", "n", *STAMP}
        assert row["run"] == run.name
    assert [own.name for own in path.parent.iterdir()] == ["bench.json"]


def test_the_page_says_which_tables_are_of_which_run() -> None:
    spec = importlib.util.spec_from_file_location("make_speed", ROOT / "docs/make_speed.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    records = json.loads(module.DATA.read_text(encoding="utf-8"))
    assert all(set(STAMP) <= set(row) for row in records)
    names = list(dict.fromkeys(row["run"] for row in records))
    text = module.runs(records)
    for k, name in enumerate(names, start=1):
        (line,) = (own for own in text.splitlines() if own.startswith(f"| {k} |"))
        for row in records:
            assert (module.kind_of(row) in line) == any(
                other["run"] == name and module.kind_of(other) == module.kind_of(row)
                for other in records
            )
    assert (module.ONE in text) == (len(names) == 1)
    mixed = [{**row, "run": "x" if k else "y"} for k, row in enumerate(records[:2])]
    assert "of 2 runs" in module.runs(mixed)
