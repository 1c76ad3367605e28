"""The JSON Schema takes every predefined problem and refuses keys that nobody reads."""

from __future__ import annotations

import copy
import json
import re
import tomllib
from collections.abc import Iterator
from functools import cache
from typing import Any

import pytest

from mechdae.cli import main
from mechdae.describe.file import library
from mechdae.describe.file.schema import compact, schema
from mechdae.describe.tasks.constraints import CONSTRAINTS
from mechdae.describe.tasks.goals import GOALS
from mechdae.describe.units import EVERY
from tests.shared.paths import DOCS

TYPES = {"object": dict, "array": list, "string": str, "boolean": bool, "integer": int}
KNOWN = {
    "$schema", "title", "description", "type", "const", "enum", "pattern", "minimum", "required",
    "properties", "additionalProperties", "minProperties", "items", "minItems", "maxItems",
    "oneOf", "anyOf", "allOf", "$id", "examples",
}  # fmt: skip


@cache
def described() -> dict[str, Any]:
    return json.loads(json.dumps(schema()))


def is_of(value: Any, kind: str) -> bool:
    if kind == "number":
        return isinstance(value, int | float) and not isinstance(value, bool)
    return isinstance(value, TYPES[kind]) and not (kind == "integer" and isinstance(value, bool))


def faults(value: Any, rule: Any, place: str = "") -> Iterator[str]:
    """Yield what is wrong with a value, by those keywords of JSON Schema that are in use."""
    if isinstance(rule, bool):
        if not rule:
            yield f"{place}: not allowed"
        return
    assert set(rule) <= KNOWN, set(rule) - KNOWN
    if "type" in rule and not is_of(value, rule["type"]):
        yield f"{place}: no {rule['type']}"
        return
    if "const" in rule and value != rule["const"]:
        yield f"{place}: not {rule['const']}"
    if "enum" in rule and value not in rule["enum"]:
        yield f"{place}: not one of {rule['enum']}"
    if isinstance(value, str) and not re.search(rule.get("pattern", ""), value):
        yield f"{place}: not like {rule['pattern']}"
    if "minimum" in rule and is_of(value, "number") and value < rule["minimum"]:
        yield f"{place}: below {rule['minimum']}"
    for word, most in (("oneOf", 1), ("anyOf", 99)):
        each = [list(faults(value, part, place)) for part in rule.get(word, ())]
        if each and not 1 <= sum(not found for found in each) <= most:
            yield f"{place}: {word} {min(each, key=len)}"
    for part in rule.get("allOf", ()):
        yield from faults(value, part, place)
    if isinstance(value, list):
        if not rule.get("minItems", 0) <= len(value) <= rule.get("maxItems", len(value)):
            yield f"{place}: {len(value)} items"
        for i, item in enumerate(value):
            yield from faults(item, rule.get("items", True), f"{place}[{i}]")
    if isinstance(value, dict):
        if len(value) < rule.get("minProperties", 0):
            yield f"{place}: {len(value)} entries"
        for key in rule.get("required", ()):
            if key not in value:
                yield f"{place}: no {key}"
        for key, item in value.items():
            inside = rule.get("properties", {}).get(key, rule.get("additionalProperties", True))
            yield from faults(item, inside, f"{place}.{key}")


@cache
def data(name: str) -> Any:
    return tomllib.loads(library.find(name).read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", library.names())
def test_predefined_problems_are_valid(name: str) -> None:
    assert list(faults(data(name), described())) == []


def tables(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the paths of tables whose keys are not the user's names."""
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for key, item in items:
        if isinstance(item, dict | list):
            if isinstance(item, dict) and not named(path, key):
                yield (*path, key)
            yield from tables(item, (*path, key))


def named(path: tuple[Any, ...], key: Any) -> bool:
    sections = ("bodies", "joints", "loads", "tasks", "parameters", "sketch", "outputs", "sizes")
    words = ("points", "repeat", "free", "start", "start_speed", "vary", "samples", "tolerances")
    return key in words or (key in sections and (not path or path[0] == "repeat"))


@pytest.mark.parametrize(
    "name",
    ["n-four-bar", "straight-180-1-4", "fg4-sin-0-90-90-90", "rocker-50-1-15", "engine-run-up",
     "pendulum-dry-circle", "slider-crank-least-loss", "four-stroke-engine"],
)  # fmt: skip
def test_unknown_keys_are_not(name: str) -> None:
    seen = 0
    for path in tables(data(name)):
        changed = copy.deepcopy(data(name))
        table = changed
        for key in path:
            table = table[key]
        table["zzz"] = 1
        assert list(faults(changed, described())), path
        seen += 1
    assert seen > 5


SWEEP = "kind = 'minimise', of = 'turn/x'"


@pytest.mark.parametrize(
    ("task", "good"),
    [
        ("goal = { kind = 'path', point = 'a.P', targets_mm = [[1, 2], [3, '4*x']] }", True),
        ("goal = { kind = 'path', point = 'a.P', targets = [[1, 2], [3]] }", False),
        ("goal = { kind = 'path', point = 'a.P', targets = [[1, 2]] }", False),
        ("goal = { kind = 'path', targets = [[1, 2], [3, 4]] }", False),
        ("goal = { kind = 'path', point = 'a.P', targets = [[1, 2], [3, 4]], closed = 1 }", False),
        ("goal = { kind = 'motion', body = 'a', poses = [[1, 2, 0], [3, 4, 1]] }", True),
        ("goal = { kind = 'straight-line', point = 'a.P', arc_deg = 180 }", True),
        ("goal = { kind = 'straight-line', point = 'a.P', arc = 1, arc_deg = 180 }", False),
        ("goal = { kind = 'straight-line', point = 'a.P', arc_mm = 180 }", False),
        ("goal = { kind = 'straight-line', point = 'a.P' }", False),
        ("goal = { kind = 'nearest', point = 'a.P' }", False),
        (f"goals = [{{ {SWEEP} }}, {{ {SWEEP}, weight = 2 }}]", True),
        (f"goals = {{ {SWEEP} }}", False),
        ("constraints = [{ kind = 'transmission-angle', between = ['a', 'b'], min = 1 }]", True),
        ("constraints = [{ kind = 'transmission-angle', between = ['a', 'b'] }]", False),
        ("constraints = [{ kind = 'box', points = ['a.P'], x = [0, 1, 2] }]", False),
        ("free = { a = [1, 2], b = { ratios = [1, 2] }, p = { point = 'g.P', disc = [0, 0, 1] } }",
         True),
        ("free = { a = [1] }", False),
        ("free = { a = { ratio = [1] } }", False),
        ("free = {}", False),
        ("driver = { coordinate = 'a.angle', at = [1] }", False),
    ],
)  # fmt: skip
def test_goals_freedoms_and_constraints(task: str, good: bool) -> None:
    rule = described()["properties"]["tasks"]
    table = {"design": {"kind": "synthesis", **tomllib.loads(task)}}
    assert (not list(faults(table, rule))) == good, list(faults(table, rule))


def keys_of(rule: Any) -> Iterator[str]:
    """Yield all keys that a schema describes."""
    for key, inside in rule.get("properties", {}).items():
        yield key
        yield from keys_of(inside)
    rest = [rule.get("items"), rule.get("additionalProperties"), *rule.get("oneOf", ())]
    for part in rest:
        if isinstance(part, dict):
            yield from keys_of(part)


def test_every_key_is_documented() -> None:
    pages = sorted((DOCS / "reference").glob("*.md"))  # but those made of the schema itself
    written = [page for page in pages if page.stem not in ("keys", "commands")]
    text = " ".join(page.read_text(encoding="utf-8") for page in written)
    for key in set(keys_of(described())):
        bases = {key, *(key.removesuffix(suffix) for suffix in EVERY)}
        assert any(re.search(rf"`[^`]*\b{base}\b", text) for base in bases), key


def test_every_kind_of_goal_and_constraint_is_described() -> None:
    tasks = described()["properties"]["tasks"]["additionalProperties"]["oneOf"]
    own = next(t for t in tasks if t["properties"]["kind"]["const"] == "synthesis")["properties"]
    for rule, kinds in ((own["goal"], GOALS), (own["constraints"]["items"], CONSTRAINTS)):
        assert [e["properties"]["kind"]["const"] for e in rule["oneOf"]] == list(kinds)


# -- what is printed: the same, with what occurs several times under $defs ---------------------


@cache
def printed() -> dict[str, Any]:
    return json.loads(json.dumps(compact(schema())))


def spelled_out(rule: Any) -> Any:
    """Return a rule with what it refers to in its place."""
    if isinstance(rule, list):
        return [spelled_out(part) for part in rule]
    if not isinstance(rule, dict):
        return rule
    rest = {word: spelled_out(part) for word, part in rule.items() if word not in ("$ref", "$defs")}
    if "$ref" not in rule or not isinstance(rule["$ref"], str):
        return rest
    return spelled_out(printed()["$defs"][rule["$ref"].removeprefix("#/$defs/")]) | rest


def test_what_is_printed_says_the_same_in_150_kilobytes(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema"]) == 0
    text = capsys.readouterr().out
    assert len(text.encode()) < 150_000
    assert json.loads(text) == printed()
    assert spelled_out(printed()) == described()
    assert printed()["$id"].startswith("urn:mechdae:")


def test_every_key_is_described_with_its_unit() -> None:
    """What an editor shows beside a key: what it is, its unit, an example."""
    bare, front = [], [described()]
    while front:
        rule = front.pop()
        for name, part in rule.get("properties", {}).items() if isinstance(rule, dict) else ():
            if "kind" in rule["properties"] and name not in ("kind", "between"):
                bare += [name] * (not part.get("description"))
            front.append(part)
        for word in ("additionalProperties", "items"):
            front += [rule[word]] if isinstance(rule.get(word), dict) else []
        for word in ("oneOf", "anyOf", "allOf"):
            front += rule.get(word, [])
    assert not bare
    joints = spelled_out(printed()["properties"]["joints"])["additionalProperties"]["oneOf"]
    hinge = next(joint for joint in joints if joint["properties"]["kind"] == {"const": "revolute"})
    assert {"between", "friction", "pin_radius", "pin_radius_mm"} <= set(hinge["properties"])
    assert hinge["properties"]["pin_radius_mm"]["description"].endswith("[m]")
    assert hinge["properties"]["pin_radius_mm"]["examples"] == ["2*r"]


@pytest.mark.slow
def test_a_public_validator_takes_every_problem() -> None:
    jsonschema = pytest.importorskip("jsonschema", reason="jsonschema is not installed")
    jsonschema.Draft202012Validator.check_schema(printed())
    validator = jsonschema.Draft202012Validator(printed())
    for name in library.names():
        data = tomllib.loads(library.find(name).read_text(encoding="utf-8"))
        assert list(validator.iter_errors(data)) == [], name
    wrong = tomllib.loads(library.find("slider-crank").read_text(encoding="utf-8"))
    first = next(iter(wrong["joints"].values()))
    first["pin_radius_deg"] = 1
    assert list(validator.iter_errors(wrong))
