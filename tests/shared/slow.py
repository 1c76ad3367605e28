"""Tests that ``pytest`` leaves out unless they are named: each with what makes it slow."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

SLOW: Mapping[str, tuple[str, str]] = {
    "attack": ("random and mutated mechanisms, planted slips", "*"),
    "assembly": (
        "searches for all assembly modes of random groups",
        "bar_gaps drawn_sketch drawn_start mode_tree no_others opened opening redundant "
        "spatial_modes three_points triads undecided wishbone",
    ),
    "assignments": ("whole classes of variants", "assignments"),
    "bench": ("times many tasks", "bench_motion"),
    "chains": ("all chains and variants of many links", "chains variants"),
    "continuation": (
        "poses next to change points, in 50 digits",
        "hard_cases quintic_steps touching",
    ),
    "describe": ("hundreds of files with mistakes, all keys", "repeat spatial_vectors suffixes"),
    "draw": (
        "draws many pictures",
        "all_curves closes draw_layout draw_synthesis fill graphs plans sheet space_diagram",
    ),
    "dynamics": (
        "whole motions beside closed forms and free bodies",
        "equilibrium_modes first_poses gliding_friction motion motion_contacts "
        "motion_diagnostics motion_kept motion_reactions motion_stiff motion_together "
        "motion_watch spatial_motion spatial_motion_friction spatial_motion_gears",
    ),
    "equations": ("structures of all predefined problems", "structure"),
    "exchange": ("files run in MuJoCo, read by CAD packages", "drawings mujoco robots"),
    "explanations": ("papers of many mechanisms, beside sums by hand", "explanations"),
    "forces": (
        "reactions of random mechanisms beside free bodies",
        "assumed driven_robots idle_links lift_off quasi_static reactions_audit "
        "reactions_hard reactions_laws spatial_friction spatial_power spatial_reactions "
        "static_friction vectors_beside_bodies",
    ),
    "homotopy": ("paths to all solutions", "linkages"),
    "house": ("runs what the documents show, reads all sources", "articles bounds docs site"),
    "jobs": ("jobs that are killed and go on, in processes", "jobs jobs_cluster"),
    "kernels": ("kernels of many structures", "reaches"),
    "kinematics": (
        "random loops, contacts on curves",
        "assembled_ends curve_corners field_mechanisms regular_loops space",
    ),
    "measures": ("measures of many sweeps", "measure_errors"),
    "page": (
        "pages in a browser and in a notebook",
        "all_pages browser find_curves notebook page page_drivers page_random",
    ),
    "proof": (
        "writes, alters and checks certificates",
        "boxes certificates checker lists plane spatial_modes",
    ),
    "ranking": ("solves and ranks many variants", "rank"),
    "schemes": ("whole compositions", "composition_job scheme_targets"),
    "studies": ("thousands of sets", "batches statics_paths"),
    "synthesis": (
        "whole syntheses from many starts",
        "dynamic_synthesis exact exact_complete freudenstein front_ends fronts robust "
        "slider_dyads spatial_designs starts synthesis synthesis_dynamic "
        "synthesis_planted synthesis_repairs",
    ),
    "tasks": ("all kinds of tasks on many mechanisms", "small_mechanisms solver"),
}
"""Folder -> why, and which of its files ``test_NAME.py``: those of more than some three seconds."""


def reason(path: Path, tests: Path) -> str:
    """Return why the tests of a file are slow, "" for others."""
    folder, _, file = path.relative_to(tests).as_posix().rpartition("/")
    why, names = SLOW.get(folder.split("/")[0], ("", ""))
    stem = file.removeprefix("test_").removesuffix(".py")
    return why if names == "*" or stem in names.split() else ""
