"""Four-bars drawn at random near one of their foldings: does the motion go where the numbers lead?

`python -m tests.attack.near_crossings --count 2000 --out docs/data/near-crossings.json`; what is
there of a run that was stopped is taken up again. Every pose that is `ok` is compared with the
closed form in 60 digits for the float64 numbers given. A mechanism is *open* where poses beyond the
folding are `ambiguous`; of those it is told by how many units in the last place of the lengths
the branches miss each other.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np

import mechdae as md
from tests.shared.mechanisms import four_bar

OFF = np.concatenate([-np.logspace(-0.2, -9, 8), [0], np.logspace(-9, -0.2, 8)])
SMALLEST, LARGEST = -15.5, -11.5
DIGITS = 60


def pin(lengths: tuple[Any, ...], angle: float) -> tuple[Any, Any]:
    """Return the bar's end C, above the diagonal, at a crank angle."""
    a, b, c, d = lengths
    B = a * mp.expj(mp.mpf(angle))
    along = d - B
    L = abs(along)
    k = (b * b + L * L - c * c) / (2 * L)
    C = B + (k + 1j * mp.sqrt(b * b - k * k)) * along / L
    return C.real, C.imag


def drawn(seed: int) -> tuple[tuple[float, ...], float, int] | None:
    """Return lengths, the crank angle of the folding and its kind; None where branches cross."""
    rng, kind = np.random.default_rng([9, seed]), seed % 3
    a, b, d = rng.uniform(0.5, 1.5), rng.uniform(1, 3), rng.uniform(1.8, 3)
    excess = float(rng.choice([-1, 1]) * 10 ** rng.uniform(SMALLEST, LARGEST))
    c = (a + d - b, b - (d - a), b + (d - a))[kind] + excess
    lengths = tuple(map(float, (a, b, c, d)))
    at = np.pi if kind == 0 else 0.0
    if c < 0.2 or missed(lengths, kind) == 0:
        return None
    beside = abs(d - a * np.exp(1j * (at - 0.8)))  # whether it assembles where it is sketched
    return (lengths, at, kind) if abs(b - c) < beside < b + c else None


def missed(lengths: tuple[float, ...], kind: int) -> Any:
    """Return by how much the lengths miss the crossing, exactly."""
    a, b, c, d = map(mp.mpf, lengths)
    return ((a + d) - (b + c), c - b + (d - a), c - b - (d - a))[kind]


def places(lengths: tuple[float, ...]) -> float:
    """Return the sum of one unit in the last place of each length."""
    return float(sum(np.spacing(abs(own)) for own in lengths))


def looked_at(lengths: tuple[float, ...], at: float, kind: int) -> dict[str, Any]:
    """Return what the package says of one four-bar, and how far poses that are ok are off."""
    exact = tuple(map(mp.mpf, lengths))
    d = lengths[3]
    C = complex(mp.mpc(*pin(exact, at - 0.8)))
    B = lengths[0] * np.exp(1j * (at - 0.8))
    sketch = {"crank": at - 0.8, "coupler": np.angle(C - B), "rocker": np.angle(C - d)}
    mechanism = four_bar(*lengths, **{key: float(own) for key, own in sketch.items()})
    driver = md.Driver("crank.angle", at=(at + OFF).tolist(), speed=1.0)
    began = time.process_time()
    result = md.solve(mechanism, md.Sweep(driver, derivatives=1))
    seconds = time.process_time() - began
    place, wrong, largest = result.points["rocker.C"].position, 0, 0.0
    for k in np.flatnonzero(result.status == "ok"):
        true = pin(exact, float(at + OFF[k]))
        off = max(abs(float(t - mp.mpf(float(p)))) for t, p in zip(true, place[k], strict=True))
        wrong += off > result.bound.length[k] + 1e-15
        largest = max(largest, off)
    words = {str(word) for word in result.status}
    kinds = {event["kind"] for event in result.events}
    return {
        "open": "ambiguous" in words | kinds,
        "missed_in_places": abs(float(missed(lengths, kind))) / places(lengths),
        "ok": int(np.sum(result.status == "ok")),
        "wrong": int(wrong),
        "estimated": result.summary.get("bound") == "estimated",
        "words": sorted(words),
        "kinds": sorted(kinds),
        "seconds": round(seconds, 3),
    }


def figures(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return counts over all four-bars."""
    left = [row["missed_in_places"] for row in rows if row["open"]]
    told = [row["missed_in_places"] for row in rows if not row["open"]]
    return {
        "mechanisms": len(rows),
        "poses_ok": sum(row["ok"] for row in rows),
        "ok_and_wrong": sum(row["wrong"] for row in rows),
        "open": len(left),
        "open_missed_in_places": [min(left, default=None), max(left, default=None)],
        "decided_missed_in_places_at_least": min(told, default=None),
        "decided_below_one_and_a_half": sum(own < 1.5 for own in told),
        "limits": sum("limit" in row["kinds"] for row in rows),
        "seconds_median": float(np.median([row["seconds"] for row in rows])),
    }


def sentence(found: dict[str, Any]) -> str:
    """Return the figures as a sentence of a page."""
    return (
        f"of {found['mechanisms']} none has a pose that is `ok` and further off than its bound "
        f"({found['poses_ok']} poses), {found['limits']} turn back, {found['open']} are left open; "
        f"their lengths miss the crossing by less than "
        f"{found['open_missed_in_places'][1]:.2f} units in the last place of each."
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--rows", type=Path, help="what is found one by one; taken up again")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    rows: dict[str, dict[str, Any]] = {}
    if options.rows and options.rows.exists():
        rows = json.loads(options.rows.read_text(encoding="utf-8"))
    with mp.workdps(DIGITS):
        seed = max(map(int, rows), default=-1)
        while len(rows) < options.count:
            seed += 1
            found = drawn(seed)
            if found is None:
                continue
            rows[str(seed)] = looked_at(*found)
            if len(rows) % 20 == 0 or len(rows) == options.count:
                for path, data in ((options.rows, rows), (options.out, figures([*rows.values()]))):
                    if path:
                        path.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(figures([*rows.values()])))


if __name__ == "__main__":
    main()
