"""How much of a picture 9 cm wide mechanisms fill: all that are drawn."""

from __future__ import annotations

import numpy as np

from mechdae.describe.file.library import names
from tests.shared.drawn import filled
from tests.shared.predefined import predefined


def test_mechanisms_fill_their_pictures():
    shares = {
        name: filled(name)
        for name in names()
        if any(task.kind in ("sweep", "reactions") for task in predefined(name).tasks.values())
    }
    assert len(shares) > 70
    assert np.median([*shares.values()]) >= 0.65
    assert min(shares.values()) >= 0.42, min(shares, key=shares.__getitem__)
