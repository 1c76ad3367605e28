"""All assembly modes by paths, by eigenvalues and by searches: trusses, platforms on six legs.

`python -m tests.scripts.all_modes --platforms 1000 --out docs/data/all-modes.json`; what is there
of a run that was stopped is taken up again with `--rows FILE`.
"""

from __future__ import annotations

import argparse
import json
import re
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import mechdae as md
from mechdae.motion.assembly import group_search
from mechdae.numerics.homotopy.platforms import platform_poses
from mechdae.parts.types.chains.chains import KinematicChain, chains
from mechdae.parts.types.chains.mechanisms import mechanism_of
from tests.reference.dixon import all_poses
from tests.shared.paths import DATA


def driven(chain: KinematicChain, places: Any) -> md.Mechanism:
    """Return a truss, its pins at places (n, 2), one ground pin of it on a driven crank."""
    drawn = mechanism_of(chain, places.tolist())
    name = next(iter(drawn.ground.points))
    x, y = drawn.ground.points[name]
    points = {**drawn.ground.points, "pivot": (x - 0.3, y)}
    del points[name]
    crank = md.Body("crank", {"pivot": (0, 0), name: (0.3, 0)})
    joints = [
        replace(joint, first=f"crank.{name}") if joint.name == name else joint
        for joint in drawn.joints.values()
    ]
    pivot = md.Revolute("pivot", "ground.pivot", "crank.pivot")
    return md.Mechanism(
        ground=md.Ground(points),
        bodies=[crank, *drawn.bodies.values()],
        joints=[pivot, *joints],
        sketch={**drawn.sketch, "crank": 0.0},
    )


def angles(result: md.Result) -> Any:
    """Return exp(i angle) (n, bodies) of all modes."""
    return np.exp(1j * np.stack([body.angle for body in result.bodies.values()], axis=1))


def complex_poses(result: md.Result) -> int:
    """Return how many complex poses are certified."""
    found = re.search(r"(\d+) (?:of \d+ )?complex poses are certified", result.summary["basis"])
    return int(found[1]) if found else 0


def missed(ours: Any, theirs: Any) -> int:
    """Return how many poses of others (n, bodies) are not among ours."""
    gaps = [float(np.abs(ours - own).max(axis=1).min(initial=9.0)) for own in theirs]
    return int(sum(gap > 1e-6 for gap in gaps))


def by_eigenvalues(chain: KinematicChain, places: Any) -> Any:
    """Return the turns (n, bodies) of all complex poses by Dixon's determinant."""
    frame = chain.fixed or 0
    order = [frame, *(k for k in range(chain.links) if k != frame)]
    points = places @ [1, 1j]
    links = [
        {k: complex(points[k]) for k, joint in enumerate(chain.joints) if link in joint}
        for link in order
    ]
    return max((all_poses(links, hidden) for hidden in (1, 2)), key=len)


def compared(chain: KinematicChain, rng: Any, searched: bool) -> dict[str, Any]:
    """Return what paths, eigenvalues and searches find for one set of lengths."""
    places = rng.normal(size=(len(chain.joints), 2))
    mechanism = driven(chain, places)
    task = md.Modes(md.Driver("crank.angle", at=[0.0]))
    began = time.process_time()
    found = md.solve(mechanism, task)
    row = {
        "proven": found.summary["proven"],
        "real": found.summary["count"],
        "complex": complex_poses(found),
        "seconds": time.process_time() - began,
    }
    if not row["proven"]:
        row["basis"] = found.summary["basis"]
    ours = angles(found)[:, 1:]
    w = by_eigenvalues(chain, places)[:, 1:]
    real = w[(np.abs(np.abs(w) - 1) < 1e-6).all(axis=1)]
    row["eigenvalues"] = [len(w), len(real), missed(ours, real), missed(real, ours)]
    if searched:
        honest, group_search.of_cases = group_search.of_cases, lambda question: []
        began = time.process_time()
        other = md.solve(mechanism, task)
        group_search.of_cases = honest
        row["searched"] = other.summary["count"]
        row["search_seconds"] = time.process_time() - began
        row["not_among"] = missed(ours, angles(other)[:, 1:])
    return row


Rows = dict[int, tuple[int, list[dict[str, Any]]]]
"""By number of the group its truss and what was found for its sets of lengths."""


def of_groups(links: int, options: argparse.Namespace, known: Rows) -> Iterator[Rows]:
    """Yield what is known of the groups of a size after each one; those known are not done again.

    Each group has numbers of its own, so that parts of a run count.
    """
    every = [(n, chain) for n, truss in enumerate(chains(links, 0)) for chain in truss.inversions()]
    for number, (truss, chain) in list(enumerate(every))[:: options.sample]:
        if number in known and len(known[number][1]) >= options.sets:
            continue
        rng = np.random.default_rng([links, number])
        searched = options.every > 0 and number % options.every == 0
        known[number] = truss, [compared(chain, rng, searched) for _ in range(options.sets)]
        yield known


def counted(links: int, known: Rows) -> dict[str, Any]:
    """Return the figures of all groups of a size that are known."""
    rows = [row for _, own in known.values() for row in own]
    seconds = sorted(row["seconds"] for row in rows)
    both = [row for row in rows if "searched" in row]
    wanted = {truss: max(row["complex"] for n, own in known.values() if n == truss for row in own)
              for truss, _ in known.values()}  # fmt: skip
    whole = [row["eigenvalues"][0] == wanted[truss] for truss, own in known.values() for row in own]
    return {
        "links": links - 1,
        "groups": len(known),
        "sets": len(rows),
        "proven": sum(row["proven"] for row in rows),
        "not_proven": [[number, k, row["basis"]] for number, (_, own) in sorted(known.items())
                       for k, row in enumerate(own) if not row["proven"]],
        "complex": sorted(wanted.values()),
        "real": [min(row["real"] for row in rows), max(row["real"] for row in rows)],
        "median_seconds": round(seconds[len(seconds) // 2], 3),
        "largest_seconds": round(seconds[-1], 3),
        "eigenvalues_complete": sum(whole),
        "eigenvalues_more_complex": sum(row["eigenvalues"][0] > row["complex"] for row in rows),
        "missed_by_paths": sum(row["eigenvalues"][2] for row in rows),
        "missed_by_eigenvalues": sum(row["eigenvalues"][3] for row in rows),
        "searched": len(both),
        "search_only": sum(row["not_among"] for row in both),
        "search_missed": sum(row["real"] > row["searched"] for row in both),
        "search_median_seconds": round(float(np.median([row["search_seconds"] for row in both])), 3)
        if both
        else None,
    }  # fmt: skip


def of_sliding(sets: int) -> Iterator[dict[str, Any]]:
    """Yield counts over groups of six links with one to three slides, drawn at random."""
    rng = np.random.default_rng(6)
    groups = [chain for truss in chains(7, 0) for chain in truss.inversions()]
    rows: list[tuple[bool, int, int, int, float]] = []
    while len(rows) < sets:
        chain = groups[rng.integers(len(groups))]
        first = next(k for k, joint in enumerate(chain.joints) if (chain.fixed or 0) in joint)
        others = [k for k in range(len(chain.joints)) if k != first]
        slides = rng.choice(others, rng.integers(1, 4), replace=False)
        kinds = "".join("P" if k in slides else "R" for k in range(len(chain.joints)))
        places = rng.normal(size=(len(chain.joints), 2))
        mechanism = driven(replace(chain, pairs=kinds), places)
        task = md.Modes(md.Driver("crank.angle", at=[0.0]))
        began = time.process_time()
        try:
            found = md.solve(mechanism, task)
        except md.MechdaeError:
            continue  # slides that leave a part to move or to stick
        seconds = time.process_time() - began
        if not complex_poses(found):
            continue  # falls into dyads and triads
        honest, group_search.of_cases = group_search.of_cases, lambda question: []
        other = md.solve(mechanism, task)
        group_search.of_cases = honest
        only = missed(angles(found)[:, 1:], angles(other)[:, 1:])
        count = found.summary["count"]
        rows.append((found.summary["proven"], count, only, count - other.summary["count"], seconds))
        proven, real, theirs, lost, times = (list(own) for own in zip(*rows, strict=True))
        yield {
            "sets": len(rows),
            "proven": int(sum(proven)),
            "real": [min(real), max(real)],
            "search_only": int(sum(theirs)),
            "search_missed": int(sum(own > 0 for own in lost)),
            "median_seconds": round(float(np.median(times)), 3),
            "largest_seconds": round(max(times), 3),
        }


def of_named() -> list[dict[str, Any]]:
    """Return how groups of the literature fare, whose real poses are known to 26 digits."""
    known = json.loads((DATA / "planar_groups.json").read_text(encoding="utf-8"))["groups"]
    rows = []
    for name, cases in known.items():
        for case in cases:
            mechanism = written(case)
            task = md.Modes(md.Driver("crank.angle", at=[float(case["crank_angle"])]))
            began = time.process_time()
            found = md.solve(mechanism, task)
            seconds = time.process_time() - began
            bodies = [body for body in found.bodies if body != "crank"]
            theirs = [[float(own[body]) for body in bodies] for own in case["solutions"]]
            row = {
                "group": name,
                "proven": found.summary["proven"],
                "complex": complex_poses(found),
                "real": found.summary["count"],
                "known": len(theirs),
                "missed": missed(angles(found)[:, 1:], np.exp(1j * np.array(theirs))),
                "seconds": round(seconds, 3),
            }
            rows.append(row)
    return rows


def written(case: dict[str, Any]) -> md.Mechanism:
    """Return a group of the reference data."""

    def points(own: dict[str, Any]) -> dict[str, tuple[float, ...]]:
        return {name: tuple(float(x) for x in place) for name, place in own.items()}

    return md.Mechanism(
        ground=md.Ground(points(case["ground"])),
        bodies=[md.Body(name, points(own)) for name, own in case["bodies"].items()],
        joints=[md.Revolute(f"J{k}", *pair) for k, pair in enumerate(case["revolutes"])],
    )


def of_triads(sets: int) -> dict[str, Any]:
    """Return how the truss of five links fares beside Dixon's determinant, closed form here."""
    rng, every = np.random.default_rng(5), [c for t in chains(5, 0) for c in t.inversions()]
    rows = []
    for k in range(sets * len(every)):
        chain = every[k % len(every)]
        places = rng.normal(size=(len(chain.joints), 2))
        found = md.solve(driven(chain, places), md.Modes(md.Driver("crank.angle", at=[0.0])))
        w = by_eigenvalues(chain, places)[:, 1:]
        real = w[(np.abs(np.abs(w) - 1) < 1e-6).all(axis=1)]
        ours = angles(found)[:, 1:]
        rows.append((found.summary["proven"], len(w), len(ours), missed(ours, real), len(real)))
    proven, whole, own, lost, theirs = (list(part) for part in zip(*rows, strict=True))
    return {
        "groups": len(every),
        "sets": len(rows),
        "proven": int(sum(proven)),
        "complex": sorted(set(whole)),
        "real": [min(own), max(own)],
        "as_many_real": int(sum(a == b for a, b in zip(own, theirs, strict=True))),
        "missed": int(sum(lost)),
    }


def of_platforms(count: int) -> Iterator[dict[str, Any]]:
    """Yield counts over random platforms on six legs, each built round a pose, every 20."""
    rng = np.random.default_rng(40)
    rows = []
    for k in range(count):
        base, platform, place = rng.normal(size=(6, 3)), rng.normal(size=(6, 3)), rng.normal(size=3)
        R = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        R *= np.sign(np.linalg.det(R))
        legs = np.linalg.norm(place + platform @ R.T - base, axis=1)
        began = time.process_time()
        found = platform_poses(base, platform, legs)
        seconds = time.process_time() - began
        gap = np.abs(found.position - place).max(axis=1).min(initial=9.0)
        rows.append((found.proven, found.regular, len(found.position), seconds, gap))
        if (k + 1) % 20 == 0 or k + 1 == count:
            proven, regular, real, seconds, gaps = (list(own) for own in zip(*rows, strict=True))
            yield {
                "platforms": k + 1,
                "proven": int(sum(proven)),
                "not_proven": [[i, own] for i, own in enumerate(regular) if not proven[i]],
                "pose_lost": int(sum(gap > 1e-6 for gap in gaps)),
                "real": [min(real), max(real)],
                "median_seconds": round(float(np.median(seconds)), 3),
                "largest_seconds": round(max(seconds), 3),
            }


def table(known: dict[str, Any]) -> str:
    """Return the figures as text of a page."""
    lines = [
        "| groups | sets | complex poses of the trusses | proven | real modes | median, largest "
        "| modes only eigenvalues find | sets in which eigenvalues are complete "
        "| modes only the search finds | sets in which the search missed one |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for own in known.values():
        if "links" not in own:
            continue
        low, high = own["real"]
        lines.append(
            f"| {own['groups']} of {own['links']} links | {own['sets']} | "
            f"{', '.join(map(str, own['complex']))} | {own['proven']} | {low} … {high} | "
            f"{own['median_seconds']:.2f}, {own['largest_seconds']:.2f} s | "
            f"{own['missed_by_paths']} | {own['eigenvalues_complete']} | {own['search_only']} | "
            f"{own['search_missed']} of {own['searched']} |"
        )
    if own := known.get("six links with slides"):
        low, high = own["real"]
        lines += [
            "",
            f"{own['sets']} groups of six links with one to three slides: {own['proven']} proven, "
            f"{low} … {high} real modes, {own['search_only']} that only the search finds, "
            f"{own['search_missed']} sets in which the search missed one; median "
            f"{own['median_seconds']:.2f} s with the count and monodromy of a new structure.",
        ]
    if own := known.get("groups of 4 links"):
        low, high = own["real"]
        lines += [
            "",
            f"{own['groups']} groups of 4 links (closed form), {own['sets']} sets: {own['proven']} "
            f"proven, {low} … {high} real modes, as many as eigenvalues give in "
            f"{own['as_many_real']}, {own['missed']} that only these find.",
        ]
    if rows := known.get("known groups"):
        names = [
            f"{row['group'].replace('_', ' ')} {row['real']} real of {row['complex']}"
            for row in rows
        ]
        lines += [
            "",
            f"Groups of the literature with real poses known to 26 digits: {', '.join(names)}; "
            f"{sum(row['proven'] for row in rows)} of {len(rows)} proven, "
            f"{sum(row['missed'] for row in rows)} poses missed, largest "
            f"{max(row['seconds'] for row in rows):.2f} s.",
        ]
    if own := known.get("platforms"):
        low, high = own["real"]
        lines += [
            "",
            f"{own['platforms']} platforms on six legs, each drawn round a pose: "
            f"{own['proven']} proven, {own['pose_lost']} poses lost, {low} … {high} real ones, "
            f"median {own['median_seconds']:.2f} s, largest {own['largest_seconds']:.2f} s.",
        ]
    return "\n".join(lines)


def between(page: str, word: str, text: str) -> str:
    """Return a page with what is between two marks replaced."""
    head, _, rest = page.partition(f"<!-- {word} -->")
    return (
        f"{head}<!-- {word} -->\n{text}\n<!-- /{word} -->{rest.partition(f'<!-- /{word} -->')[2]}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--links", type=int, nargs="*", default=[7, 9])
    parser.add_argument("--sets", type=int, default=20)
    parser.add_argument("--every", type=int, default=1, help="groups of which one is searched too")
    parser.add_argument("--sample", type=int, default=1, help="every so many groups only")
    parser.add_argument("--sliding", type=int, default=0, help="sets of groups with slides")
    parser.add_argument("--named", action="store_true", help="triads, groups of the literature")
    parser.add_argument("--platforms", type=int, default=0)
    parser.add_argument("--rows", type=Path, help="what is found set by set; taken up again")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--page", type=Path, help="page to write the figures into")
    options = parser.parse_args()
    known = json.loads(options.out.read_text()) if options.out and options.out.exists() else {}
    rows = json.loads(options.rows.read_text()) if options.rows and options.rows.exists() else {}

    def save() -> None:
        for path, data in ((options.out, known), (options.rows, rows)):
            if path:
                path.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")

    for links in options.links:
        own: Rows = {int(k): (n, r) for k, (n, r) in rows.get(str(links), {}).items()}
        for found in of_groups(links, options, own):
            rows[str(links)] = {str(k): value for k, value in found.items()}
            known[f"groups of {links - 1} links"] = counted(links, found)
            save()
        print(json.dumps(known.get(f"groups of {links - 1} links")), flush=True)
    if options.named:
        known["groups of 4 links"] = of_triads(options.sets)
        known["known groups"] = of_named()
        save()
    for found in of_sliding(options.sliding):
        known["six links with slides"] = found
        save()
    for found in of_platforms(options.platforms):
        known["platforms"] = found
        save()
    print(json.dumps(known.get("platforms")), flush=True)
    if options.page:
        text = between(options.page.read_text(encoding="utf-8"), "modes", table(known))
        options.page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
