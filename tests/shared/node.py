"""JavaScript run by Node.js, where there is one."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

NODE = shutil.which("node")
needs_node = pytest.mark.skipif(NODE is None, reason="no Node.js")


def run_script(text: str, folder: Path) -> Any:
    """Return what a module script prints as JSON."""
    assert NODE is not None
    script = folder / "script.mjs"
    script.write_text(text, encoding="utf-8")
    done = subprocess.run([NODE, str(script)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
