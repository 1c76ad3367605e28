"""The data that a page or an editor holds, read back from its file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from mechdae.parts.page import link


def data_of(file: str | Path) -> Any:
    """Return the data of a page, without the values at its poses."""
    text = Path(file).read_text(encoding="utf-8").partition(link.OPENING)[2]
    return json.loads(text.partition("</script>")[0])
