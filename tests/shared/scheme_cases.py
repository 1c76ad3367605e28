"""Small tasks of composition for several tests."""

from __future__ import annotations

BEAN = """
schema = 1
title = "A scheme for a bean"
[tasks.scheme]
kind = "composition"
links = [4]
objectives = ["error", "material"]
reference = [0.75, 30]
samples = 600
starts = 4
grow = 1
points = 6
keep = 6
seed = 3
[tasks.scheme.goal]
kind = "curve"
x = "2*cos(s)"
y = "1.2*sin(s) + 0.5*cos(s)**2"
"""
