"""Docstrings of records, made when they are read, and their methods as ``help`` shows them."""

from __future__ import annotations

import inspect
from types import FunctionType

METHODS = ("__init__", "__repr__", "__eq__", "__hash__", "__setattr__", "__delattr__")


def docstring(cls: type, text: str) -> str:
    """Return the docstring of a record, with what its class says of the fields (`documented`)."""
    for name in METHODS:
        method = vars(cls).get(name)
        if isinstance(method, FunctionType) and hasattr(method, "compiled"):
            method = vars(method)["compiled"]()
            type.__setattr__(cls, name, method)
        if isinstance(method, FunctionType) and "_more" in method.__code__.co_varnames:
            takes = inspect.signature(method).parameters.values()
            shown = [one for one in takes if one.name != "_more"]
            vars(method)["__signature__"] = inspect.Signature(shown, return_annotation=None)
        elif isinstance(method, FunctionType) and method.__module__ == "mechdae.records":
            method.__name__ = name
    return str(getattr(cls, "documented", str)(text))
