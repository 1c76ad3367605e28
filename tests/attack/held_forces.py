"""Holding forces of random loaded mechanisms against virtual work: no speed is given.

python -m tests.attack.held_forces --count 34
"""

from __future__ import annotations

import argparse
import sys

import numpy as np

from tests.shared.held import FAMILIES, held

CLOSE = 1e-7
"""Share of the forces by which differences of fourth order may be off."""


def worst(family: str, count: int, seed: int = 1) -> float:
    """Return the largest error of the efforts of some mechanisms, as a share of their forces."""
    rng = np.random.default_rng(seed)
    return max(held(rng, family).off() for _ in range(count))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=34, help="mechanisms of each family")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    found = {family: worst(family, asked.count, asked.seed) for family in FAMILIES}
    for family, error in found.items():
        print(f"{family:13} {asked.count} mechanisms, off by {error:.1e} of their forces at most")
    return int(max(found.values()) > CLOSE)


if __name__ == "__main__":
    sys.exit(main())
