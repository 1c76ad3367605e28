"""Mechanisms of pins whose points follow one after the other as intersections of circles.

Nothing but distances between points on one link is used, and the side on which a point lay at the
start. All angles of a turn are followed at once.
"""

from __future__ import annotations

import tomllib

import numpy as np


def followed(places, links, turns):
    """Return the places of all points (t,) by name, and the least share of a circle left over.

    Parameters
    ----------
    places
        Name -> (x, y) in one pose; the crank's pivot is the point of the frame on its link.
    links
        Names of the points of each link, the frame first, then the crank.
    turns
        (t,) angles of the crank from that pose [rad].

    Notes
    -----
    The share is the squared height of the triangle over the square of its bar: negative where two
    circles do not meet.
    """
    start = {name: complex(*spot) for name, spot in places.items()}
    frame, crank, *others = [list(own) for own in links]
    found = {name: np.full(len(turns), start[name]) for name in frame}
    pivot = next(name for name in crank if name in frame)
    spin = np.exp(1j * np.asarray(turns))
    for name in crank:
        found[name] = start[pivot] + (start[name] - start[pivot]) * spin
    least = np.inf
    missing = {name for own in others for name in own} - found.keys()
    while missing:
        before = len(missing)
        for name in sorted(missing):
            known = [(p, own) for own in others if name in own for p in own if p in found]
            same = [own for own in others if name in own and len(found.keys() & set(own)) > 1]
            if same:  # two points of one link are there
                one, other = [p for p in same[0] if p in found][:2]
            elif len({tuple(own) for _, own in known}) > 1:
                one, rest = known[0]
                other = next(p for p, own in known if own != rest)
            else:
                continue
            found[name], height = _met(start, found, name, one, other)
            if not same:
                least = min(least, float(height.min()))
            missing.remove(name)
            break
        assert len(missing) < before, f"no two circles for {missing}"
    return found, least


def _met(start, found, name, one, other):
    a, b = abs(start[name] - start[one]), abs(start[name] - start[other])
    gap = found[other] - found[one]
    far = np.abs(gap)
    foot = (a**2 - b**2 + far**2) / (2 * far)
    height = a**2 - foot**2
    side = np.sign(((start[other] - start[one]).conjugate() * (start[name] - start[one])).imag)
    up = 1j * side * np.sqrt(np.maximum(height, 0.0))
    return found[one] + gap / far * (foot + up), height / max(a, b) ** 2


def of_file(text):
    """Return places and links of a problem file whose links are sketched by their angles."""
    data = tomllib.loads(text)
    frame = {name: complex(*spot) for name, spot in data["ground"]["points"].items()}
    spots, links = dict(frame), [list(frame)]
    bodies = {name: body["points"] for name, body in data["bodies"].items()}
    waiting = list(bodies)
    while waiting:
        for name in waiting:
            points = {own: complex(*spot) for own, spot in bodies[name].items()}
            known = next((own for own in points if own in spots), None)
            if known is None:
                continue
            turn = np.exp(1j * data["sketch"][name])
            for own, spot in points.items():
                spots.setdefault(own, spots[known] + turn * (spot - points[known]))
            waiting.remove(name)
            break
    links += [list(points) for points in bodies.values()]
    return {name: (spot.real, spot.imag) for name, spot in spots.items()}, links
