"""Checks of vector loops: orders whose vectors meet, mechanisms written as loops."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from typing import Any

import numpy as np

import mechdae as md
from mechdae.describe import dumps
from mechdae.describe.file.load import from_dict
from mechdae.describe.vectors.loops_in_space import SpatialLoops
from mechdae.describe.vectors.loops_of import Written
from mechdae.describe.vectors.translation import new_point
from mechdae.parts.types.chains.variants.orders import Orders, cyclic
from mechdae.parts.types.chains.variants.scheme import planar
from mechdae.parts.types.ranking.variants import MotionOfVaried, fault_of, first_sweep
from tests.shared.vector_loops import gap, least_gap, random_loops


def again(given: md.Variant | md.Problem) -> md.Problem:
    """Return a variant's or a problem as its file gives it."""
    text = given.text if isinstance(given, md.Variant) else dumps(given)
    return from_dict(tomllib.loads(text), given.name)


def loops_of(problem: md.Problem) -> dict[str, list[str]]:
    closure: Any = problem.mechanism.closure
    return {name: list(loop) for name, loop in closure.loops.items()}


def vectors_at(problem: md.Problem, result: Any, k: int) -> dict[str, np.ndarray]:
    """Return the vectors (2,) of a pose, by the angles of links and the slides of joints."""
    mechanism: Any = problem.mechanism
    closure, values = mechanism.closure, mechanism.values()
    found = {}
    for name, vector in closure.vectors.items():
        body, turn = closure.directions[name]
        number = values.get(turn, turn) if isinstance(turn, str) else turn
        angle = (result.bodies[body].angle[k] if body else 0.0) + float(number)
        length = vector.length
        if length is None:
            length = result.joints[f"{name}_slide"].slide[k]
        elif isinstance(length, str):
            length = values[length]
        found[name] = length * np.array([np.cos(angle), np.sin(angle)])
    return found


def check_closed(variant: md.Variant, task: str) -> None:
    """Check that all vectors of all poses meet where the order says."""
    problem = again(variant)
    result = md.solve(problem, task, poses=3)
    for k, status in enumerate(result.status):
        if status == "ok":
            vectors = vectors_at(problem, result, k)
            size = max(float(np.hypot(*vector)) for vector in vectors.values())
            assert gap(loops_of(problem), vectors) <= 1e-12 * size, variant.name


def tried(rng: np.random.Generator, count: int, orders: int, starts: int) -> tuple[int, int]:
    """Check some orders of a random mechanism; return how many assemble, and how many do not."""
    net = random_loops(rng, count)
    problem = net.problem()
    motion = MotionOfVaried(problem)
    if motion.result.fault:
        return 0, 0  # a limit within the little interval
    made = Orders(problem, motion.pose)
    every = [cyclic(len(loop)) for loop in net.loops.values()]
    given = {name: (net.length(name), net.angle(name)) for name in net.ends}
    unknown = {**net.unknown, "crank": ""}
    good = bad = 0
    for _ in range(orders):
        chosen = {
            name: [net.loops[name][i] for i in choice[int(rng.integers(len(choice)))]]
            for name, choice in zip(net.loops, every, strict=True)
        }
        variant = made.of(chosen)
        fault = variant.fault or fault_of(variant)
        if not fault:
            check_closed(variant, "turn")
            good += 1
            continue
        least = least_gap(chosen, unknown, given, {}, rng, starts)
        assert least > 1e-7, (chosen, fault)
        bad += 1
    return good, bad


def solved(problem: md.Problem, task: str) -> Any:
    poses = 7 if getattr(problem.tasks[task], "poses", None) else None
    return md.solve(problem, task, **({"poses": poses} if poses else {}))


def check_same(problem: md.Problem) -> int:
    """Check a problem against its loops; return how many there are."""
    written = Written(problem)
    loops = again(written.problem)
    closure: Any = loops.mechanism.closure
    task = first_sweep(problem)
    if task is None:
        return len(closure.loops)
    one, two = solved(problem, task), solved(loops, task)
    assert list(one.status) == list(two.status)
    ok = [k for k, word in enumerate(one.status) if word == "ok"]
    size = problem.mechanism.scale
    for name, body in one.bodies.items():
        new = two.bodies[written.called.get(name, name)]
        off = new.angle[ok] - body.angle[ok]
        assert np.abs(off - 2 * np.pi * np.round(off / (2 * np.pi))).max() < 1e-9
        for word in ("angular_velocity", "angular_acceleration"):
            rates = [getattr(series, word) for series in (body, new)]
            if rates[0] is not None:
                assert np.allclose(rates[1][ok], rates[0][ok], rtol=1e-8, atol=1e-8)
    for name, point in one.points.items():
        new = two.points[new_point(name, written.called, written.points)]
        assert np.abs(new.position[ok] - point.position[ok]).max() <= 1e-9 * size, name
        if point.acceleration is not None:
            largest = np.abs(point.acceleration[ok]).max()
            assert np.abs(new.acceleration[ok] - point.acceleration[ok]).max() <= 1e-8 * (
                1 + largest
            )
    return len(closure.loops)


def bodies_of(rng: np.random.Generator, count: int) -> md.Problem:
    """Return a random mechanism as bodies and joints."""
    return planar(random_loops(rng, count).problem(), loops=False)


def loaded(turned: bool) -> md.Problem:
    """Return a four-bar with loads between links and outputs, its last pin one way or the other."""
    base = md.load("four-bar-crank-rocker").mechanism
    last = base.joints["D"]
    if turned:
        last = md.Revolute("D", last.second, last.first)
    loads = [
        md.Resistance("work", "rocker.angle", negative=4.0, positive=7.0),
        md.Spring("pull", between=("ground.D", "coupler.P"), stiffness=300.0, free_length=0.05),
        md.Spring("twist", coordinate="rocker.angle", stiffness=2.0, free_length=0.4, preload=0.3),
        md.TableLoad("push", coordinate="rocker.angle", rows=((-3.0, 1.0), (3.0, 2.5)),
                     along="rocker.angle"),
    ]  # fmt: skip
    mechanism = replace(
        base, joints={**base.joints, "D": last}, loads={load.name: load for load in loads},
        outputs={"lean": "2*rocker.angle - coupler.angle", "x": "coupler.P.x + 3*coupler.P.y"},
    )  # fmt: skip
    cycle = md.Reactions(driver=md.Driver("crank.angle", from_=0.2, to=6.4), poses=25)
    return md.Problem(mechanism, {"cycle": cycle})


def work_gap(turned: bool) -> float:
    """Return by how much inversions of a loaded four-bar differ in effort and outputs."""
    found = list(md.variants(loaded(turned), "inversion"))
    assert [variant.about["fixed"] for variant in found] == ["ground", "crank", "coupler", "rocker"]
    first = md.solve(again(found[0]), "cycle")
    known = first.efforts["crank.angle"]
    assert np.ptp(known) > 4
    worst = 0.0
    for variant in found[1:]:
        assert variant.left_out == ()
        result = md.solve(again(variant), "cycle")
        (effort,) = result.efforts.values()
        # virtual work of the same relative motion
        worst = max(worst, float(np.abs(effort - known).max() / np.abs(known).max()))
        lean, x = (result.outputs[w].value - first.outputs[w].value for w in ("lean", "x"))
        lean = lean - 2 * np.pi * np.round(lean / (2 * np.pi))
        worst = max(worst, float(np.abs(lean).max()), float(np.abs(x).max()))
    return worst


def turned(problem: md.Problem, rng: np.random.Generator) -> md.Problem:
    """Return a problem whose links but the driven ones have frames turned at random."""
    mechanism = problem.mechanism
    driven = {d.coordinate.split(".")[0] for task in problem.tasks.values()
              for d in getattr(task, "all_drivers", ())}  # fmt: skip
    by = {name: 0.0 if name in driven else float(rng.uniform(-3, 3)) for name in mechanism.bodies}
    by["ground"] = 0.0
    values = mechanism.values()
    bodies = []
    for name, body in mechanism.bodies.items():
        back = np.exp(-1j * by[name])
        places = {p: back * complex(*(values[f"{name}.{p}.{a}"] for a in "xy"))
                  for p in body.points}  # fmt: skip
        bodies.append(replace(body, points={p: (z.real, z.imag) for p, z in places.items()}))
    joints = []
    for joint in mechanism.joints.values():
        first, second = joint.first_body, joint.second_body
        changes: dict[str, float] = {}
        if joint.guide or joint.slot:
            changes["axis"] = values[f"{joint.name}.axis"] - by[first]
        if joint.guide:
            changes["turn"] = values[f"{joint.name}.turn"] + by[second] - by[first]
        joints.append(replace(joint, **changes))
    sketch = {name: values.get(name, value) if isinstance(value, str) else value
              for name, value in mechanism.sketch.items()}  # fmt: skip
    sketch = {name: float(value) + by.get(name, 0.0) for name, value in sketch.items()}
    new = replace(mechanism, bodies={b.name: b for b in bodies},
                  joints={j.name: j for j in joints}, sketch=sketch)  # fmt: skip
    return replace(problem, mechanism=new)


def check_same_in_space(problem: md.Problem, task: str) -> None:
    """Check positions within the bounds of both, and rates, at the points that both have."""
    loops = again(md.loops_of(problem))
    points = SpatialLoops(problem).points(loops.mechanism)
    poses = {"poses": 9} if getattr(problem.tasks[task], "poses", None) else {}
    one, two = md.solve(problem, task, **poses), md.solve(loops, task, **poses)
    assert list(one.status) == list(two.status)
    ok = np.array(one.status) == "ok"
    assert ok.any()
    room = (one.bound.length + two.bound.length)[ok]
    far = max(1.0, float(one.condition[ok].max()) / 10) ** 2  # near a limit rates lose digits
    compared = 0
    for name, point in one.points.items():
        new = points.get(name, name)
        if new.startswith("ground.") or new not in two.points:
            continue
        compared += 1
        gap = np.linalg.norm(two.points[new].position[ok] - point.position[ok], axis=1)
        assert (gap <= room).all(), name
        for word in ("velocity", "acceleration"):
            rates = (two.points[new].get(word), point.get(word))
            if rates[0] is not None and rates[1] is not None:
                largest = 1 + np.abs(rates[1][ok]).max()
                assert np.abs(rates[0][ok] - rates[1][ok]).max() <= 1e-11 * far * largest, (
                    name,
                    word,
                )
    assert compared
    check_vectors(loops, two, ok)


def check_vectors(loops: md.Problem, result: Any, ok: np.ndarray) -> None:
    """Check each vector by its own length, elevation and azimuth between its ends."""
    closure: Any = loops.mechanism.closure
    values = loops.mechanism.values()

    def place(point: str) -> np.ndarray:
        if point.startswith("ground."):
            return np.array([values[f"{point}.{axis}"] for axis in "xyz"])
        return np.asarray(result.points[point].position[ok])

    for name, vector in closure.vectors.items():
        if vector.from_ is not None:
            continue
        tail, head = (place(end) for end in closure.ends[name])
        series = result.joints[name]
        length, e, a = (series[word][ok] if word in series else values[f"{name}.{word}"]
                        for word in ("length", "elevation", "azimuth"))  # fmt: skip
        level = length * np.cos(e)
        span = np.stack(np.broadcast_arrays(level * np.cos(a), length * np.sin(e),
                                            level * np.sin(a)), axis=-1)  # fmt: skip
        assert np.abs(span - (head - tail)).max() < 1e-12 * (1 + np.abs(length).max())
