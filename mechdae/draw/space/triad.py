"""The axes of the fixed frame, in the emptiest corner of a picture."""

from __future__ import annotations

import numpy as np

from mechdae.draw import style
from mechdae.draw.fonts import font
from mechdae.draw.labels import layout
from mechdae.draw.labels.obstacles import Obstacles
from mechdae.draw.sheet import Sheet, normal, unit
from mechdae.draw.space.viewpoint import Viewpoint

ARM = 24.0
"""Length of an axis that lies in the plane of the picture."""
ROOM = 34.0
"""Half the side of what is kept free for it."""
SMALL = 0.12
"""An axis that looks shorter than this share of its length points at the eye: a dot."""


def draw_triad(sheet: Sheet, view: Viewpoint) -> None:
    """Draw the directions x, y, z in a corner where they cover least."""
    low, high = ROOM * 0.8, sheet.size - ROOM * 0.8
    corners = np.array(
        [(low, low + style.STRIP), (low, high[1]), (high[0], low + style.STRIP), tuple(high)]
    )
    half = np.array([ROOM, ROOM])
    spot = corners[layout.cheapest(corners, half * 0.8, Obstacles(*sheet.obstacles(), sheet.size))]
    arms = ARM * view.flat(np.eye(3))
    middle = spot - (arms.min(axis=0) + arms.max(axis=0)) / 2
    order = np.argsort(view.seen(np.eye(3))[:, 2])
    for k in order.tolist():
        name, arm = "xyz"[k], arms[k]
        color = style.FAINT
        tip = middle + arm
        if np.hypot(*arm) < SMALL * ARM:
            sheet.circle(middle, 2.0, fill=color, edge=color, z=style.Z_MARK, gid=f"axis-{name}")
            away = -unit(arms.sum(axis=0))
            away = away if away.any() else np.array([-1.0, -1.0])
            place = middle + 9.0 * away
        else:
            along = unit(arm)
            sheet.line([middle, tip - 4.0 * along], color=color, gid=f"axis-{name}")
            back, side = tip - 6.0 * along, 2.2 * normal(along)
            sheet.area([tip, back + side, back - side], fill=color, edge=color, width=0.3)
            place = tip + 6.5 * along
        sheet.text(place, name, font(11.0, style="italic"), color, f"axis-{name}-label", "")
    sheet.box(spot - half * 0.9, spot + half * 0.9)
