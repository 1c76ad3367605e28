"""Builds the compiled machine of `mechdae.kernels.machine` where a C compiler is.

hatchling calls it when the package is built or installed; without a compiler, or without
Python's headers, the package is built without the machine and nothing is said. By hand,
``python build_machine.py`` builds it beside its sources.
"""

from __future__ import annotations

import os
import platform
import shlex
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path
from typing import Any

try:
    from hatchling.builders.hooks.plugin.interface import BuildHookInterface
except ImportError:  # by hand

    class BuildHookInterface:  # type: ignore[no-redef]
        """Stands for hatchling's."""


FOLDER = Path("mechdae/kernels/machine")
NAME = "_machine.abi3.so"
SAFE = ["-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"]
"""None of these changes a number."""
LINK = ["-std=c11", "-fPIC", "-shared", "-fvisibility=hidden"]
SWITCH = "MECHDAE_BUILD_MACHINE"
"""0: do not build it."""


def compiled(root: Path, target: Path) -> bool:
    """Compile the machine; return whether it was, and can be loaded."""
    if os.environ.get(SWITCH) == "0" or os.name != "posix" or sys.version_info < (3, 11):
        return False
    if platform.python_implementation() != "CPython" or sysconfig.get_config_var("Py_GIL_DISABLED"):
        return False
    given = os.environ.get("CC")
    loose = ["-undefined", "dynamic_lookup"] if sys.platform == "darwin" else []
    for cc in [shlex.split(given)] if given else [["cc"], ["gcc"], ["clang"]]:
        include = f"-I{sysconfig.get_paths()['include']}"
        strip = [] if loose else ["-s"]
        source = str(root / FOLDER / "machine.c")
        command = [*cc, *SAFE, *LINK, *strip, *loose, include, source, "-o", str(target), "-lm"]
        try:
            done = subprocess.run(command, capture_output=True, timeout=300, check=False)
        except (OSError, subprocess.SubprocessError):
            continue
        if done.returncode == 0 and target.is_file():
            return True
    return False


def tag() -> str:
    """Return the wheel's tag: any Python from 3.11 on, this platform."""
    from packaging.tags import sys_tags

    of_many = ("manylinux", "musllinux")
    places = (t.platform for t in sys_tags() if not t.platform.startswith(of_many))
    return f"cp311-abi3-{next(places)}"


class MachineHook(BuildHookInterface):
    """Puts the machine into wheels; an editable installation has it beside its sources."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build before files are collected; any failure leaves a wheel without the machine."""
        if self.target_name != "wheel":
            return
        root = Path(self.root)
        try:
            if version == "editable":
                build(root)
                return
            self._place = tempfile.TemporaryDirectory()
            target = Path(self._place.name) / NAME
            if compiled(root, target):
                build_data["force_include"][str(target)] = (FOLDER / NAME).as_posix()
                build_data["pure_python"] = False
                build_data["tag"] = tag()
        except OSError:
            return


def build(root: Path) -> bool:
    """Build the machine beside its sources; what is there stays until the new one is whole."""
    folder = root / FOLDER
    try:
        with tempfile.TemporaryDirectory(dir=folder) as place:
            target = Path(place) / NAME
            made = compiled(root, target)
            if made:
                os.replace(target, folder / NAME)
    except OSError:
        return False
    return made


if __name__ == "__main__":
    done = build(Path(__file__).resolve().parent)
    print("built" if done else "no C compiler, or no headers of Python")
    raise SystemExit(not done)
