"""Labels of assembly modes from poses alone: orientations and signs of determinants.

The equations of the joints are written once more, from their definitions, as functions of
the poses of bodies; Jacobians are differences.
"""

from __future__ import annotations

import cmath
import math
import re

import numpy as np

STEP = 1e-6


class Poses:
    """One row of a result: bodies as (place of a point, angle), points as complex numbers."""

    def __init__(self, mechanism, result, row):
        self.mechanism = mechanism
        self.values = mechanism.values()
        self.where, self.angle = {}, {"ground": 0.0}
        for body in mechanism.bodies:
            first = next(iter(mechanism.bodies[body].points))
            self.where[body] = (first, complex(*result.points[f"{body}.{first}"].position[row]))
            self.angle[body] = float(result.bodies[body].angle[row])

    def local(self, body, point):
        return complex(self.values[f"{body}.{point}.x"], self.values[f"{body}.{point}.y"])

    def place(self, reference, moved):
        body, point = reference.split(".")
        if body == "ground":
            return self.local(body, point)
        first, place = self.where[body]
        arm = (self.local(body, point) - self.local(body, first)) * cmath.exp(1j * self.angle[body])
        dx, dy, turn = moved.get(body, (0, 0, 0))
        return place + complex(dx, dy) + arm * cmath.exp(1j * turn)

    def turned(self, body, moved):
        return self.angle[body] + moved.get(body, (0, 0, 0))[2]

    def residual(self, joint, moved):
        """Return the equations of a joint, second body minus first, with some bodies moved."""
        gap = self.place(joint.second, moved) - self.place(joint.first, moved)
        a, b = (self.turned(body, moved) for body in (joint.first_body, joint.second_body))
        get = lambda word: self.values.get(f"{joint.name}.{word}", 0.0)  # noqa: E731
        along = gap * cmath.exp(-1j * (a + get("axis")))
        kind = joint.kind
        if kind == "revolute":
            return [gap.real, gap.imag]
        if kind == "prismatic":
            return [along.imag, b - a - get("turn")]
        if kind == "pin-in-slot":
            return [along.imag]
        if kind == "weld":
            return [gap.real, gap.imag, b - a - get("turn")]
        if kind == "distance":
            return [(abs(gap) ** 2 / get("length") - get("length")) / 2]
        carrier = self.turned(joint.carrier, moved) if joint.carrier else 0.0
        if kind == "rack":
            tooth = gap * cmath.exp(-1j * (b + get("axis")))
            return [tooth.real - get("radius") * (a - carrier) - get("phase")]
        sense = -1 if getattr(joint, "crossed", False) else 1
        return [sense * get("ratio") * (b - carrier) + get("phase") - (a - carrier)]

    def determinant(self, bodies, joints, driver):
        """Return the sign of the Jacobian of a group, rows and columns in declared order."""
        order = [b for b in self.mechanism.bodies if b in bodies]
        kept = [j for j in self.mechanism.joints.values() if j.name in joints]

        def rows(moved):
            found = [r for joint in kept for r in self.residual(joint, moved)]
            if driver in self.mechanism.bodies:
                found.append(self.turned(driver, moved))
            elif driver:  # the slide of a ram or a cylinder
                joint = self.mechanism.joints[driver]
                gap = self.place(joint.second, moved) - self.place(joint.first, moved)
                axis = self.turned(joint.first_body, moved) + self.values[f"{driver}.axis"]
                found.append((gap * cmath.exp(-1j * axis)).real)
            return np.array(found)

        size = max(abs(self.local(b, p)) for b in order for p in self.mechanism.bodies[b].points)
        columns = []
        for body in order:
            for j, unit in enumerate((size, size, 1.0)):
                step = [0.0, 0.0, 0.0]
                step[j] = STEP * unit
                back = [-s for s in step]
                columns.append((rows({body: step}) - rows({body: back})) / 2)
        J = np.array(columns).T
        J = J / np.linalg.norm(J, axis=1)[:, None]
        return float(np.linalg.det(J))

    def orientation(self, bodies, joints):
        """Return the orientation of the triangle outer pin, inner pin, outer pin of two links."""
        order = [b for b in self.mechanism.bodies if b in bodies]
        kept = [self.mechanism.joints[name] for name in joints]
        inner = next(j for j in kept if {j.first_body, j.second_body} == set(order))
        one, two = (
            next(j for j in kept if j is not inner and body in (j.first_body, j.second_body))
            for body in order
        )
        a, b, c = (self.place(j.second, {}) for j in (one, inner, two))
        return float(((b - a).conjugate() * (c - b)).imag)


def label_faults(case, mechanism, result):
    """Compare the labels of a modes task with signs and ranks computed from its poses."""
    wrong = []
    numbers = {body: i for i, body in enumerate(mechanism.bodies, 1)}
    groups = []
    for name in result.summary["groups"]:
        members = {int(n) for n in re.search(r"\(([\d,]+)\)", name)[1].split(",")}
        groups.append([body for body, number in numbers.items() if number in members])
    for g, bodies in enumerate(groups):
        name = result.summary["groups"][g]
        earlier = {"ground"} | {
            body for element in case.elements[: case.maker[bodies[0]]] for body in element.bodies
        }
        known = earlier | set(bodies)
        joints = [
            joint.name
            for joint in mechanism.joints.values()
            if {joint.first_body, joint.second_body} & set(bodies)
            and {joint.first_body, joint.second_body} <= known
        ]
        triangle = " RRR(" in name and len(bodies) == 2
        triangle &= all(mechanism.joints[j].kind == "revolute" for j in joints)
        driver = case.driver_key if re.match(r"I[ (]", name) else None
        signs, angles = [], []
        for row in range(len(result)):
            poses = Poses(mechanism, result, row)
            if triangle:
                value = poses.orientation(bodies, joints)
            else:
                value = poses.determinant(bodies, joints, driver)
            signs.append("+" if value > 0 else "-")
            angle = math.remainder(poses.angle[bodies[0]], 2 * math.pi)
            angles.append(angle)
            if abs(value) > 1e-5 and result.labels[row][g][0] != signs[-1]:
                wrong.append(f"label {result.labels[row][g]} of {name}, by its pose {signs[-1]}")
        if "II." in name or len(result.labels[0][g]) == 1:
            continue
        before = [tuple(label[:g]) for label in result.labels]
        for row, label in enumerate(result.labels):  # modes that end later are not listed
            same = [
                int(result.labels[k][g][1:])
                for k in range(len(result))
                if before[k] == before[row] and signs[k] == signs[row]
                and angles[k] < angles[row] - 1e-8
            ]  # fmt: skip
            if not int(label[g][1:]) > max(same, default=0):
                wrong.append(f"label {label[g]} of {name}, which is not in order of its angle")
    return wrong
