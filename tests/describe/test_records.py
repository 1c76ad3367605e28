"""Classes whose methods are compiled late do what those of the standard library do."""

from __future__ import annotations

import dataclasses
import inspect
import pickle
from typing import Any

import pytest

from mechdae.describe import records


def classes(make: Any) -> tuple[Any, Any, Any]:
    """Return classes of a decorator: frozen, a frozen child, one that changes."""

    @make(frozen=True)
    class Point:
        """A point."""

        x: float
        y: float = 2.0
        seen: list[int] = dataclasses.field(default_factory=list, compare=False, repr=False)

        def __post_init__(self) -> None:
            if self.x < 0:
                raise ValueError("x")

    @make(frozen=True, kw_only=True)
    class Weight(Point):
        """A point with a mass."""

        mass: float

    @make
    class Open:
        """Something that changes."""

        a: int = 1

    return Point, Weight, Open


@pytest.fixture(params=[records.dataclass, dataclasses.dataclass], ids=["late", "standard"])
def made(request: pytest.FixtureRequest) -> tuple[Any, Any, Any]:
    return classes(request.param)


def test_values(made: Any) -> None:
    Point, Weight, Open = made
    point, same = Point(1.0), Point(1.0, seen=[3])
    assert point == same
    assert hash(point) == hash(same) == hash((1.0, 2.0))
    assert point != Point(1.0, 3.0)
    assert point != Weight(1.0, mass=2.0)
    assert repr(point).endswith("Point(x=1.0, y=2.0)")
    assert dataclasses.replace(point, y=5.0).y == 5.0
    assert Point(1.0).seen is not point.seen
    assert repr(Weight(1.0, mass=4.0)).endswith("Weight(x=1.0, y=2.0, mass=4.0)")
    thing = Open()
    thing.a = 2
    assert thing == Open(2)
    with pytest.raises(TypeError, match="unhashable"):
        hash(thing)


def test_refusals(made: Any) -> None:
    Point, Weight, _ = made
    point = Point(1.0)
    with pytest.raises(dataclasses.FrozenInstanceError, match="cannot assign to field 'x'"):
        point.x = 2.0
    with pytest.raises(dataclasses.FrozenInstanceError, match="cannot delete field 'x'"):
        del point.x
    with pytest.raises(ValueError, match="x"):
        Point(-1.0)
    with pytest.raises(TypeError, match="missing 1 required positional argument: 'x'"):
        Point()
    with pytest.raises(TypeError, match="missing 1 required keyword-only argument: 'mass'"):
        Weight(1.0)


def test_signature_is_told_before_the_first_instance(made: Any) -> None:
    Point, Weight, _ = made
    assert list(inspect.signature(Point).parameters) == ["x", "y", "seen"]
    assert list(inspect.signature(Weight).parameters) == ["x", "y", "seen", "mass"]


def test_nothing_is_compiled_while_imported() -> None:
    Point, *_ = classes(records.dataclass)
    first = Point.__init__
    assert first.later is not None
    Point(1.0)
    assert Point.__init__ is not first
    assert Point.__eq__.later is not None


@records.dataclass(frozen=True)
class Kept:
    """A value."""

    a: int


def test_pickled() -> None:
    assert pickle.loads(pickle.dumps(Kept(3))) == Kept(3)
