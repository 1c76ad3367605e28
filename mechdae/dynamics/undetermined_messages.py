"""Messages for motions whose continuation the laws of dry friction do not determine."""

from __future__ import annotations

from typing import Any


class NoWay(Exception):
    """No way to go on fits the laws of friction, or several do: the verdict.

    ``status`` is that of the state, "jammed" or "ambiguous"; ``code`` and ``facts`` tell more.
    """

    def __init__(self, text: str, status: str = "jammed", code: str = "F5", **facts: Any) -> None:
        super().__init__(text)
        self.status, self.code, self.facts = status, code, facts
