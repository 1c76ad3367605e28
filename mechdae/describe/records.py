"""`dataclasses.dataclass` whose methods are compiled when they are first used, not when imported.

A program that runs one task imports a hundred and sixty classes and uses some forty of them. The
standard decorator compiles up to six methods of each while they are imported, which takes a third
of the time of such a program. Here the standard library compiles each method at its first call.
"""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:

    def dataclass(cls=None, /, *, frozen=False, eq=True, repr=True, kw_only=False):
        """Return a class with the methods of a dataclass, see `dataclasses.dataclass`."""

        def made(cls: type) -> type:
            return _made(cls, frozen, eq, repr, kw_only)

        return made if cls is None else made(cls)


def _made(cls: Any, frozen: bool, eq: bool, repr: bool, kw_only: bool) -> type:
    own = vars(cls)
    wanted = {"__init__": True, "__repr__": repr, "__eq__": eq, "__hash__": eq and frozen}
    known = {name for name in wanted if own.get(name) is not None}
    if eq and not frozen and "__hash__" not in known:
        cls.__hash__ = None
    for name, asked in wanted.items():
        if asked and name not in known:
            setattr(cls, name, _later(cls, name, frozen))
    if "__init__" not in known:
        cls.__signature__ = _Signature()
    if frozen:
        cls.__setattr__, cls.__delattr__ = _set, _delete
    return dataclasses.dataclass(init=False, repr=False, eq=False, kw_only=kw_only)(cls)


def _later(cls: Any, name: str, frozen: bool) -> Callable[..., Any]:
    """Return a method that puts the compiled one in its place."""

    def compiled() -> Any:
        made = _compiled(cls, name, frozen)
        setattr(cls, name, made)
        return made

    def method(self: Any, *args: Any, **named: Any) -> Any:
        return compiled()(self, *args, **named)

    method.later = compiled  # type: ignore[attr-defined]
    method.__name__, method.__qualname__ = name, f"{cls.__qualname__}.{name}"
    return method


def _compiled(cls: Any, name: str, frozen: bool) -> Any:
    """Return the method that the standard library gives a class of these fields."""
    words = ("default", "default_factory", "init", "repr", "hash", "compare", "kw_only")
    fields = [
        (own.name, own.type, dataclasses.field(**{word: getattr(own, word) for word in words}))
        for own in dataclasses.fields(cls)
    ]
    checks = name == "__init__" and hasattr(cls, "__post_init__")
    twin = dataclasses.make_dataclass(
        cls.__name__,
        fields,
        namespace={"__doc__": "", **({"__post_init__": None} if checks else {})},
        init=name == "__init__",
        repr=name == "__repr__",
        eq=name in ("__eq__", "__hash__"),
        frozen=frozen and name in ("__init__", "__hash__"),
    )
    made = vars(twin)[name]
    made.__qualname__ = f"{cls.__qualname__}.{name}"
    return made


class _Signature:
    """The signature of a class, for `help`, where its `__init__` is not compiled yet."""

    def __get__(self, instance: Any, owner: Any) -> inspect.Signature:
        if instance is not None:
            raise AttributeError("__signature__")
        if getattr(owner.__init__, "later", None) is not None:
            owner.__init__.later()
        whole = inspect.signature(owner.__init__)
        return whole.replace(parameters=list(whole.parameters.values())[1:])


def _set(self: Any, name: str, value: Any) -> None:
    if _is_fixed(self, name):
        raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")
    object.__setattr__(self, name, value)


def _delete(self: Any, name: str) -> None:
    if _is_fixed(self, name):
        raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")
    object.__delattr__(self, name)


def _is_fixed(self: Any, name: str) -> bool:
    """Return whether an attribute is a field, or of a class that has nothing but its fields."""
    return "__dataclass_fields__" in vars(type(self)) or name in type(self).__dataclass_fields__
