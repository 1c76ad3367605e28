"""Poses as balls have them, to the last bit; all complex ones at one value of the driver."""

from __future__ import annotations

import random
from typing import Any

from flint import acb, ctx

from mechdae.certificates import check
from mechdae.certificates.mechanism import as_text
from mechdae.errors import UnavailableError

STARTS, MOST_STARTS = 200, 1000
"""Starts for each pose that is sought, and in all."""


def refined_path(mechanism: dict[str, Any], path: dict[str, Any]) -> dict[str, Any]:
    """Return a path with its poses to the last bit; those that balls do not prove as they were."""
    m = _checked(mechanism)
    places = [path, *path["steps"]]
    for place, at in zip(
        places, [path["at"], *(step["to"] for step in path["steps"])], strict=True
    ):
        place["bodies"] = _refined(m, place, at) or place["bodies"]
    for word, sense, near in (("low", -1, path), ("high", 1, places[-1])):
        if word in path:
            at = near["at"] if near is path else near["to"]
            try:
                z = check.solution(m, m.claimed(near, check.exact(at, word), word)).box()
                claim = m.claimed(path[word], check.exact(path[word]["at"], word), word)
                path[word]["bodies"] = _bodies(m, check.turning(m, z, claim, sense, word))
            except (ArithmeticError, check.FalseClaim):
                pass  # the check says what is wrong
    return path


def refined_mode(mechanism: dict[str, Any], mode: dict[str, Any], at: str) -> dict[str, Any]:
    """Return a mode with its pose to the last bit."""
    return mode | {"bodies": _refined(_checked(mechanism), mode, at) or mode["bodies"]}


def _checked(mechanism: dict[str, Any]) -> check.Checked:
    ctx.prec, ctx.cap = check.PRECISION, 3
    return check.Checked(mechanism)


def _refined(m: check.Checked, claim: dict[str, Any], at: str) -> dict[str, list[str]] | None:
    """Return the pose near a claim, None where balls do not prove one."""
    try:
        return _bodies(m, check.solution(m, m.claimed(claim, check.exact(at, "at"), "at")).z)
    except ArithmeticError:
        return None


def _bodies(m: check.Checked, z: list[Any]) -> dict[str, list[str]]:
    return {
        body: [as_text(v.mid()) for v in z[3 * k : 3 * k + 3]] for k, body in enumerate(m.bodies)
    }


def complex_poses(content: dict[str, Any], real: list[dict[str, Any]]) -> list[list[list[str]]]:
    """Return places to look at for all complex poses, the real ones first: (re, im) of each number.

    Raises
    ------
    UnavailableError
        No theorem tells how many poses a group has, or random starts do not lead to all of them.
    """
    ctx.prec, ctx.cap = check.PRECISION, 3
    m = check.Checked(content["mechanism"])
    u = check.exact(content["at"], "at")
    count, known = 1, {"ground"}
    for group in content["groups"]:
        try:
            count *= check.most(m, group, known)
        except check.FalseClaim:
            raise UnavailableError(
                "no certificate is written of modes of groups other than the driven link, dyads "
                f"and platforms on three legs: {', '.join(group)}"
            ) from None
        known |= set(group)
    starts = [[acb(v) for v in m.claimed(mode, u, "modes")] for mode in real]
    found = _found(m, u, content["groups"], starts, count)
    if len(found) < count:
        raise UnavailableError(
            f"{len(found)} complex poses of {count} are found: others are singular or at infinity, "
            "so no certificate is written"
        )
    return [[[as_text(x.real.mid()), as_text(x.imag.mid())] for x in pose[:-1]] for pose in found]


def _found(
    m: check.Checked, u: Any, groups: list[list[str]], starts: list[Any], count: int
) -> list[list[Any]]:
    """Return up to `count` different poses in balls, from the starts and from random ones.

    A random start keeps the first groups of a pose that is found, and draws the others.
    """
    rng, found = random.Random(7), list[list[Any]]()
    for k in range(len(starts) + min(STARTS * count, MOST_STARTS)):
        if len(found) == count:
            break
        z = starts[k] if k < len(starts) else _start(m, u, groups, found, rng)
        try:
            pose = check.solution(m, z).box()
        except ArithmeticError:
            continue
        mirrored = [acb(x.real, -x.imag) for x in pose]
        for own in (pose, mirrored):  # the mirror image of a pose is one
            if not any(check.alike(own, other) for other in found):
                found.append(own)
    return found


def _start(
    m: check.Checked, u: Any, groups: list[list[str]], found: list[Any], rng: random.Random
) -> list[Any]:
    """Return a random complex place to begin from."""
    kept = {body for group in groups[: rng.randrange(len(groups))] for body in group}
    base, z = rng.choice(found) if found else None, []
    for k, body in enumerate(m.bodies):
        if base is not None and body in kept:
            z += base[3 * k : 3 * k + 3]
            continue
        z += [acb(rng.gauss(0, m.size), rng.gauss(0, m.size)) for _ in range(2)]
        z.append(acb(rng.uniform(-3.2, 3.2), rng.gauss(0, 0.7)))
    return [*z, acb(u)]
