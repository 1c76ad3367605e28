"""The editor as one HTML file, empty or with a mechanism to go on with."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mechdae.describe.file.problem import Problem
from mechdae.describe.file.writing import dumps
from mechdae.describe.joints import Joint
from mechdae.describe.mechanism import GROUND, Mechanism
from mechdae.describe.tasks.kinds import Driven, Driver, Sweep
from mechdae.describe.units import UNITS
from mechdae.errors import InputError
from mechdae.pages import link
from mechdae.pages.document import LANGUAGES, Page
from mechdae.results import Result
from mechdae.tasks.solve import solve

SAME = 1e-9
"""Share of the mechanism within which a point is on a line."""


def editor(problem: Problem | None = None, lang: str = "en") -> Page:
    """Return the editor.

    Parameters
    ----------
    problem
        What to go on with: links with pins, sliders on the ground and slots.
    lang
        Language of its words, "en" or "ru".

    Raises
    ------
    InputError
        A joint or a body that the editor does not draw, by its key; a language that it does not
        speak.
    SolveError
        The mechanism does not assemble.
    """
    if lang not in LANGUAGES:
        raise InputError(f"no words in '{lang}'", where="lang", hint=", ".join(LANGUAGES))
    data: dict[str, Any] = {
        "schema": 1,
        "title": "drawn mechanism" if problem is None else problem.title or problem.name,
        "problem": "" if problem is None else problem.name,
        "task": "",
        "lang": lang,
        "live": True,
        "reason": "",
        "model": None,
        "kept": [],
        "names": [],
        "units": {
            own.suffix: [own.size.numerator, own.size.denominator, own.pi] for own in UNITS.values()
        },
    }
    if problem is not None:
        data["model"] = _Drawing(problem).model()
        data["names"] = _others(problem)
        data["kept"] = dumps(problem).splitlines() if data["names"] else []
    return Page(link.linked(data, "", "edit"), data)


def _others(problem: Problem) -> list[str]:
    """Return the keys of what the editor does not draw and the file keeps as comments."""
    mechanism = problem.mechanism
    found = [f"loads.{name}" for name in mechanism.loads]
    found += [
        f"bodies.{name}.mass" for name, body in mechanism.bodies.items() if body.mass is not None
    ]
    found += [f"outputs.{name}" for name in mechanism.outputs]
    found += [f"parameters.{name}" for name in mechanism.parameters]
    return found + [f"tasks.{name}" for name in problem.tasks]


class _Drawing:
    """A mechanism as nodes and links, at the pose of its sketch."""

    def __init__(self, problem: Problem) -> None:
        self.mechanism: Mechanism = problem.mechanism
        if self.mechanism.dimension != 2:
            raise InputError("the editor draws planar mechanisms", where="dimension")
        drivers = [
            own
            for task in problem.tasks.values()
            if isinstance(task, Driven)
            for own in task.all_drivers
        ]
        if not drivers:
            raise InputError("no task with a driver", where="tasks", hint="kind = sweep")
        self.driver: Driver = drivers[0]
        self.pose = self._posed(problem)
        self.values = self.mechanism.values()
        self.of: dict[str, str] = {}
        for joint in self.mechanism.joints.values():
            if not (joint.hinge or joint.guide or joint.slot):
                raise InputError(
                    f"the editor does not draw the joint kind {joint.kind}",
                    where=f"joints.{joint.name}",
                    hint="revolute, prismatic with a slider of one point, pin-in-slot",
                )
            if joint.coincide:
                self._join(joint.first, joint.second)
        self.blocks = {
            joint.second_body: joint
            for joint in self.mechanism.joints.values()
            if joint.guide and self._is_block(joint.second_body)
        }

    def _posed(self, problem: Problem) -> Result:
        """Return the pose of the sketch, or of the first task that names values."""
        name = self.driver.coordinate
        sketch = self.mechanism.sketch
        body = name.rpartition(".")[0]
        value = sketch.get(name, sketch.get(body))
        at = self.driver.at or (() if value is None else (value,))
        if not at:
            at = (self.driver.from_ if self.driver.from_ is not None else 0.0,)
        return solve(problem.mechanism, Sweep(driver=Driver(name, at=at[:1])))

    def _is_block(self, body: str) -> bool:
        """Return whether a body is a slider: one point, a guide, else pins alone."""
        joints = [own for own in self.mechanism.joints.values() if body in own.bodies]
        used = {
            own
            for joint in joints
            for own in (joint.first, joint.second)
            if own.split(".")[0] == body
        }
        guides = [joint for joint in joints if not joint.coincide]
        return len(used) == 1 and len(guides) == 1 and len(joints) > 1

    def _root(self, reference: str) -> str:
        while self.of.get(reference, reference) != reference:
            reference = self.of[reference]
        return reference

    def _join(self, first: str, second: str) -> None:
        self.of[self._root(second)] = self._root(first)

    def _place(self, reference: str) -> tuple[float, float]:
        if reference.startswith(f"{GROUND}."):
            return self.values[f"{reference}.x"], self.values[f"{reference}.y"]
        x, y = np.asarray(self.pose.points[reference].position)[0].tolist()
        return x, y

    def model(self) -> dict[str, Any]:
        """Return nodes, links and driver as the editor's modules have them."""
        nodes: dict[str, dict[str, Any]] = {}
        ids: dict[str, int] = {}

        def node(reference: str) -> dict[str, Any]:
            root = self._root(reference)
            if root not in nodes:
                x, y = self._place(reference)
                name, taken = reference.split(".")[1], {own["name"] for own in nodes.values()}
                number = 2
                while name in taken:
                    name, number = f"{reference.split('.')[1]}{number}", number + 1
                nodes[root] = {
                    "id": len(nodes) + 1,
                    **{"name": name, "x": x, "y": y, "fixed": False, "slide": None, "slot": None},
                }
            return nodes[root]

        links: list[dict[str, Any]] = []
        for name, body in self.mechanism.bodies.items():
            if name in self.blocks:
                continue
            points = [f"{name}.{point}" for point in body.points]
            if len(points) < 2:
                raise InputError(
                    "the editor draws links of two points or more", where=f"bodies.{name}"
                )
            own = list(dict.fromkeys(node(point)["id"] for point in points))
            ids[name] = 1000 + len(links)
            links.append({"id": ids[name], "name": name, "nodes": own})
        for name in self.mechanism.ground.points:
            root = self._root(f"{GROUND}.{name}")
            if root in nodes:
                nodes[root]["fixed"] = True
        for joint in self.mechanism.joints.values():
            if not joint.coincide:
                self._guide(joint, node(joint.second), ids, links, nodes)
        return {"nodes": list(nodes.values()), "links": links, "driver": self._driven(ids, node)}

    def _guide(
        self,
        joint: Joint,
        node: dict[str, Any],
        ids: dict[str, int],
        links: list[dict[str, Any]],
        nodes: dict[str, dict[str, Any]],
    ) -> None:
        """Let a node slide on the ground, or in the slot of a link."""
        where = f"joints.{joint.name}"
        if joint.guide and joint.second_body not in self.blocks:
            raise InputError("the editor draws sliders of one point", where=where)
        axis = self.values[f"{joint.name}.axis"]
        if joint.first_body == GROUND:
            node["slide"] = {"angle": axis}
            return
        body = joint.first_body
        along = (math.cos(axis), math.sin(axis))
        x0, y0 = (self.values[f"{joint.first}.{own}"] for own in "xy")
        size = self.mechanism.scale
        on_line = []
        for point in self.mechanism.bodies[body].points:
            dx = self.values[f"{body}.{point}.x"] - x0
            dy = self.values[f"{body}.{point}.y"] - y0
            if abs(along[0] * dy - along[1] * dx) <= SAME * size:
                on_line.append((along[0] * dx + along[1] * dy, f"{body}.{point}"))
        if len(on_line) < 2:
            raise InputError(
                "the editor draws slots along the line of two points of the link",
                where=where,
                hint="give the link a second point on the slot's axis",
            )
        ends = [nodes[self._root(on_line[k][1])]["id"] for k in (0, 1)]
        link_of = next(own for own in links if own["id"] == ids[body])
        link_of["nodes"] = ends + [own for own in link_of["nodes"] if own not in ends]
        node["slot"] = {"link": ids[body]}

    def _driven(self, ids: dict[str, int], node: Any) -> dict[str, Any] | None:
        name, _, word = self.driver.coordinate.rpartition(".")
        if word == "angle" and name in ids:
            return {"kind": "turn", "link": ids[name]}
        joint = self.mechanism.joints.get(name)
        if word == "slide" and joint is not None and joint.first_body == GROUND:
            return {"kind": "slide", "node": node(joint.second)["id"]}
        return None
