"""All poses of arms with six axes beside EAIK: ``python -m benchmarks.arms --targets 100000``.

Places of the hand are those of joint angles drawn at random, by matrices formed here. Each pose
drawn has to be among those found (else it is missed), each pose found has to lead to its place
(else it is false), and poses of EAIK (an extra, left out where it is not installed), as far as they
lead to the place, have to be among them. Rows that are said to be singular are counted apart.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

import mechdae as md

H = np.pi / 2
ARMS: dict[str, list[tuple[float, float, float]]] = {
    "UR5e": [
        (0, H, 0.1625), (-0.425, 0, 0), (-0.3922, 0, 0), (0, H, 0.1333), (0, -H, 0.0997),
        (0, 0, 0.0996),
    ],
    "UR10e": [
        (0, H, 0.1807), (-0.6127, 0, 0), (-0.57155, 0, 0), (0, H, 0.17415), (0, -H, 0.11985),
        (0, 0, 0.11655),
    ],
    "Puma 560": [
        (0, H, 0), (0.4318, 0, 0), (0.0203, -H, 0.15005), (0, H, 0.4318), (0, -H, 0), (0, 0, 0),
    ],
    "KUKA KR 6 R900": [
        (0.025, -H, 0.4), (0.455, 0, 0), (0.035, -H, 0), (0, H, 0.42), (0, -H, 0), (0, 0, 0.08),
    ],
    "FANUC CRX-10iA": [
        (0, -H, 0.245), (0.71, 0, 0), (0, -H, 0), (0, H, 0.54), (0, -H, 0.15), (0, 0, 0.16),
    ],
    "sixteen poses (Manseur and Doty)": [
        (0.3, H, 0), (1, 1, 0), (0, H, 0.2), (1.5, 1, 0), (0, H, 0), (0, 0, 0),
    ],
    "general": [
        (0.4, 1.3, 0.3), (-0.6, 2.1, -0.2), (0.5, 0.8, 0.4), (0.2, 1.7, 0.6), (-0.3, 2.4, 0.1),
        (0.1, 0.6, 0.2),
    ],
}  # fmt: skip
CLOSED = 4
"""How many of them have a closed form."""
LEADS, SAME = 1e-8, 1e-5
"""Distance of the hand, in sizes of the arm, of a pose; largest difference of angles of one."""


def places(links: Any, angles: Any) -> Any:
    """Return places (n, 4, 4) of the hand, by the four elementary motions of each joint."""
    T = np.tile(np.eye(4), (len(angles), 1, 1))
    for k, (a, alpha, d) in enumerate(links):
        turn, twist = np.tile(np.eye(4), (len(angles), 1, 1)), np.eye(4)
        c, s = np.cos(angles[:, k]), np.sin(angles[:, k])
        turn[:, 0, 0] = turn[:, 1, 1] = c
        turn[:, 1, 0], turn[:, 0, 1] = s, -s
        turn[:, 2, 3] = d
        twist[0, 3] = a
        twist[1:3, 1:3] = [[np.cos(alpha), -np.sin(alpha)], [np.sin(alpha), np.cos(alpha)]]
        T = T @ turn @ twist
    return T


def off(links: Any, angles: Any, hands: Any) -> Any:
    """Return how far poses (n, k, 6) are from places (n, 4, 4), in sizes of the arm; nan -> inf."""
    n, k, _ = angles.shape
    size = np.abs(np.asarray(links)[:, [0, 2]]).sum()
    gap = np.abs(places(links, angles.reshape(-1, 6)).reshape(n, k, 4, 4) - hands[:, None])
    gap[:, :, :3, 3] /= size
    worst = gap.max(axis=(2, 3))
    return np.where(np.isnan(worst), np.inf, worst)


def nearest(one: Any, many: Any) -> Any:
    """Return how far each pose (n, k, 6) is from the nearest of others (n, m, 6), (n, k)."""
    gaps = np.abs(np.exp(1j * one[:, :, None]) - np.exp(1j * many[:, None])).max(axis=3)
    return np.where(np.isnan(gaps), np.inf, gaps).min(axis=2)


def by_eaik(links: Any, hands: Any) -> tuple[Any, float] | None:
    """Return EAIK's poses (n, 16, 6), and its seconds a target; None where it solves no such."""
    try:
        from eaik.IK_DH import DhRobot
    except ImportError:
        return None
    a, alpha, d = np.array(links, float).T
    robot = DhRobot(alpha, a, d)
    if not robot.hasKnownDecomposition():
        return None
    listed = list(hands)
    start = time.process_time()
    answers = robot.IK_batched(listed, 1)
    seconds = (time.process_time() - start) / len(hands)
    poses = np.full((len(hands), 16, 6), np.nan)
    for row, answer in zip(poses, answers, strict=True):
        found = np.asarray(answer.Q, float).reshape(-1, 6)[:16]
        row[: len(found)] = found
    return poses, seconds


def measured(name: str, count: int, seed: int) -> dict[str, Any]:
    """Return what was counted and how long a target takes."""
    links = ARMS[name]
    rng = np.random.default_rng(seed)
    totals: dict[str, Any] = {"arm": name, "targets": count}
    numbers = dict.fromkeys(("missed", "false", "singular", "unproven", "out of reach", "poses"), 0)
    others = dict.fromkeys(("poses of EAIK", "of these missed", "poses EAIK has not"), 0)
    seconds, other_seconds, known, worst = [], [], False, 0.0
    md.arm_poses(links, np.eye(4)[None])
    for first in range(0, count, 10_000):
        n = min(10_000, count - first)
        drawn = rng.uniform(-np.pi, np.pi, size=(n, 6))
        hands = places(links, drawn)
        start = time.process_time()
        found = md.arm_poses(links, hands)
        seconds.append((time.process_time() - start) / n)
        real = np.isfinite(found.angles).all(axis=2)
        gap = off(links, found.angles, hands)
        sound = found.status != "singular"
        worst = max(worst, float(gap[real & sound[:, None]].max(initial=0.0)))
        numbers["poses"] += int(real.sum())
        numbers["false"] += int((real & (gap > LEADS)).sum())
        lost = nearest(drawn[:, None], found.angles)[:, 0] > SAME
        numbers["missed"] += int((lost & sound).sum())
        for status in ("singular", "unproven", "out of reach"):
            numbers[status] += int((found.status == status).sum())
        theirs = by_eaik(links, hands)
        if theirs is not None:
            known = True
            poses, each = theirs
            other_seconds.append(each)
            good = (off(links, poses, hands) < LEADS) & sound[:, None]
            others["poses of EAIK"] += int(good.sum())
            others["of these missed"] += int((good & (nearest(poses, found.angles) > SAME)).sum())
            ours = real & sound[:, None] & (nearest(found.angles, poses) > SAME)
            others["poses EAIK has not"] += int(ours.sum())
    totals |= numbers
    totals |= {"largest error": worst, "microseconds": 1e6 * float(np.median(seconds))}
    if known:
        totals |= others | {"microseconds of EAIK": 1e6 * float(np.median(other_seconds))}
    return totals


def main() -> None:
    """Measure all arms and write what was counted."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.arms", description=__doc__)
    parser.add_argument("--targets", type=int, default=100_000)
    parser.add_argument("--general", type=int, default=100_000, help="of arms without closed form")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    rows = []
    for k, name in enumerate(ARMS):
        count = options.targets if k < CLOSED else options.general
        rows.append(measured(name, count, options.seed))
        print(json.dumps(rows[-1]), flush=True)
    if options.out:
        options.out.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
