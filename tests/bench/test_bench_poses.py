"""The measurement of sweeps with other methods beside."""

from __future__ import annotations

import json

from benchmarks.__main__ import main


def test_other_means_are_never_nearer_to_the_truth(capsys, tmp_path) -> None:
    """Fewer nodes, looser tolerances."""
    assert main(["slider-crank", "--quick", "--out", str(tmp_path)]) == 0
    assert "yardstick" in capsys.readouterr().out
    records = json.loads((tmp_path / "bench.json").read_text(encoding="utf-8"))
    for record in records:
        assert {"work", "n", "ratio", "yardstick", "error", "seconds"} <= set(record)
    ours = next(record["error"] for record in records if record["method"] == "certified")
    for method in ("interpolated", "rootfinder"):
        others = [record["error"] for record in records if record["method"] == method]
        assert len(others) == 4
        assert others[0] > 10 * others[-1] > 10 * ours
    assert (tmp_path / "bench.svg").stat().st_size > 5000
