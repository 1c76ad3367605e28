"""``python -m checker FILE...``: what certificates prove; exit code 1 where a claim is false."""

from __future__ import annotations

import sys

from . import check
from .arithmetic import FalseClaim

if __name__ == "__main__":
    try:
        for path in sys.argv[1:]:
            print(check(path))
    except FalseClaim as refused:
        sys.exit(f"refused: {refused}")
