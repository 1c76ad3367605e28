"""How a pose is computed, group by group, as one would on paper: equations with their numbers."""

from __future__ import annotations

from mechdae.parts.paper.explanations.explain import Explanation, explain

__all__ = ["Explanation", "explain"]
