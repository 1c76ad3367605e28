"""Small jobs of synthesis for the tests of workers and logs."""

from __future__ import annotations

FOUR_BAR = """
schema = 1
title = "Four-bar through five points of an arc, by crank angle"
source = "case C2 of Cabrera et al. 2002, generally traced to Kunjur and Krishnamurty 1997"
[parameters]
r1 = 4
r2 = 2
r3 = 4
r4 = 3
r_cx = 1
r_cy = 1
[ground]
points = { A0 = [0, 0], B0 = ["r1", 0] }
[bodies.crank]
points = { A0 = [0, 0], A = ["r2", 0] }
[bodies.coupler]
points = { A = [0, 0], B = ["r3", 0], P = ["r_cx", "r_cy"] }
[bodies.rocker]
points = { B0 = [0, 0], B = ["r4", 0] }
[joints]
A0 = { kind = "revolute", between = ["ground.A0", "crank.A0"] }
A = { kind = "revolute", between = ["crank.A", "coupler.A"] }
B = { kind = "revolute", between = ["coupler.B", "rocker.B"] }
B0 = { kind = "revolute", between = ["ground.B0", "rocker.B0"] }
[sketch]
crank_deg = 60
coupler_deg = 20
rocker_deg = 80
[tasks.turn]
kind = "sweep"
driver = { coordinate = "crank.angle", from_deg = 0, to_deg = 360 }
poses = 73
[tasks.design]
kind = "synthesis"
driver = { coordinate = "crank.angle" }
starts = 12
seed = 3
[tasks.design.goal]
kind = "path"
point = "coupler.P"
targets = [[3, 3], [2.759, 3.363], [2.372, 3.663], [1.89, 3.862], [1.355, 3.943]]
at_deg = [30, 45, 60, 75, 90]
[tasks.design.free]
r1 = [5e-5, 50]
r2 = [5e-5, 50]
r3 = [5e-5, 50]
r4 = [5e-5, 50]
r_cx = [-50, 50]
r_cy = [-50, 50]
[[tasks.design.constraints]]
kind = "full-turn"
margin = 1e-6
"""
