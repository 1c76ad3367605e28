"""Compute the generic arm that is shipped: `python -m tests.scripts.generic_arm`."""

from __future__ import annotations

import json

import numpy as np

from mechdae.numerics.homotopy.six_axes import MOST, STORE, along, drawn, quadrics
from mechdae.numerics.homotopy.tracker import distinct, track


def main() -> None:
    rng = np.random.default_rng(16)
    p = drawn(rng)
    z = rng.normal(size=(4, 3)) + 1j * rng.normal(size=(4, 3))
    x = (z / np.sqrt((z * z).sum(axis=1))[:, None]).ravel()
    C, L, T = quadrics(p)
    miss = C + L @ x + np.einsum("rab,a,b->r", T, x, x) / 2
    p[6:11] += miss[4:9]
    p[20:] += miss[9:]
    known = x[None]
    while len(known) < MOST:
        there, bend = drawn(rng), drawn(rng)
        x = known
        for route in (along(p, there), along(there, p, bend)):
            ends = track(route, x, 1e6)
            x = ends.x[ends.followed & (ends.step < 1e-9)]
            if not len(x):
                break
        every = np.concatenate([known, x])
        known = every[distinct(every, 1e-6)]
        print(len(known), flush=True)
    rows = {
        "parameters": [[v.real, v.imag] for v in p],
        "solutions": [[[v.real, v.imag] for v in own] for own in known],
    }
    STORE.write_text(json.dumps(rows) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
