"""Compute the generic trusses that are shipped: `python -m tests.scripts.generic_trusses`."""

from __future__ import annotations

import argparse
import time

import numpy as np

from mechdae.numerics.homotopy.linkage import PinLinkage
from mechdae.numerics.homotopy.stored_instances import (
    STORE,
    canonical,
    file_name,
    generic_instance,
    read,
    written,
)
from mechdae.parts.types.chains.chains import chains


def linkage_of(chain: object) -> PinLinkage:
    """Return a chain as a linkage whose first link is fixed."""
    links: list[list[int]] = [[] for _ in range(chain.links)]  # type: ignore[attr-defined]
    for k, joint in enumerate(chain.joints):  # type: ignore[attr-defined]
        for link in joint:
            links[link].append(k)
    return PinLinkage(tuple(map(tuple, links)), tuple(range(len(links))))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--links", type=int, default=9)
    most = parser.parse_args().links
    rows = {}
    for links in range(5, most + 1, 2):
        for chain in chains(links, 0):
            began = time.process_time()
            own = canonical(linkage_of(chain))
            for seed in range(1, 6):
                numbers, x, whole = generic_instance(own.linkage, seed)
                data = written(numbers, x)
                if whole and read(own.linkage, data) is not None:
                    break
            else:
                raise SystemExit(f"not complete: {own.name}")
            rows[file_name(own.name)] = data
            print(links, len(x), f"{time.process_time() - began:.1f} s", own.name, flush=True)
    np.savez_compressed(STORE, **rows)


if __name__ == "__main__":
    main()
