"""The private folder of kernels on disk: where it is, what may be read from it, how large it grows.

Only a folder of the user's own that nobody else may enter is used. Files are written beside and
moved into place, and hold a checksum of what they say; what does not fit it is taken away. No
failure of the disk is an error: without the folder kernels are built again.
"""

from __future__ import annotations

import hashlib
import os
import stat
from contextlib import suppress
from pathlib import Path

from mechdae.records import dataclass

VARIABLE = "MECHDAE_CACHE"
"""0: nothing is kept on disk; a path: the folder."""
HEAD = b"mechdae kernel 1\n"
SUFFIX = ".kernel"
MOST_BYTES = 128_000_000
MOST_OF_ONE = 16_000_000
EVERY = 64
"""Files after which the size of the folder is looked at again."""


def place() -> Path | None:
    """Return the folder's path, None where nothing is to be kept."""
    chosen = os.environ.get(VARIABLE, "").strip()
    if chosen == "0":
        return None
    if chosen:
        return Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA") or ""
    try:
        return (Path(base) if os.path.isabs(base) else Path.home() / ".cache") / "mechdae"
    except RuntimeError:  # no home
        return None


@dataclass
class Folder:
    """A folder of kernels that are found again by name."""

    path: Path
    most_bytes: int = MOST_BYTES
    written: int = 0

    @property
    def fault(self) -> str:
        """Return why the folder is not used, empty where it is; one that is not there yet is."""
        try:
            found = os.lstat(self.path)
        except FileNotFoundError:
            return ""
        except OSError as error:
            return f"cannot be read: {error.strerror}"
        if not stat.S_ISDIR(found.st_mode):
            return "is no folder"
        if hasattr(os, "getuid"):
            if found.st_uid != os.getuid():
                return "belongs to somebody else"
            if stat.S_IMODE(found.st_mode) & 0o077:
                return "is open to others: its mode has to be 0700"
        return ""

    def _file(self, name: str) -> Path:
        return self.path / f"{name}{SUFFIX}"

    def read(self, name: str) -> str | None:
        """Return what is kept under a name, None where nothing whole is."""
        if self.fault:
            return None
        file = self._file(name)
        try:
            handle = os.open(file, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0))
            with open(handle, "rb") as stream:
                data = stream.read(MOST_OF_ONE + 1)
        except OSError:
            return None
        head, digest, text = data[: len(HEAD)], data[len(HEAD) :][:64], data[len(HEAD) + 64 :]
        if head == HEAD and digest == _digest(name, text) and len(data) <= MOST_OF_ONE:
            return text.decode("ascii")
        self.forget(name)
        return None

    def write(self, name: str, text: str) -> None:
        """Keep a text under a name; whoever reads meanwhile finds a whole one or none."""
        data = text.encode("ascii")
        if len(data) > MOST_OF_ONE - 1024:
            return
        try:
            if not self.path.is_dir():
                self.path.parent.mkdir(parents=True, exist_ok=True)
                self.path.mkdir(mode=0o700, exist_ok=True)
            if self.fault:
                return
            import tempfile  # only where something is written

            handle, name_there = tempfile.mkstemp(dir=self.path, suffix=".part")
        except OSError:
            return
        try:
            with open(handle, "wb") as stream:
                stream.write(HEAD + _digest(name, data) + data)
            os.replace(name_there, self._file(name))
        except OSError:
            with suppress(OSError):
                os.unlink(name_there)
        self.written += 1
        if self.written % EVERY == 1:
            self.shrink()

    def forget(self, name: str) -> None:
        """Take a file away."""
        with suppress(OSError):
            self._file(name).unlink()

    def files(self) -> list[tuple[float, int, Path]]:
        """Return time, size and path of what is kept, oldest first."""
        found = []
        with suppress(OSError), os.scandir(self.path) as entries:
            for entry in entries:
                if entry.name.endswith((SUFFIX, ".part")):
                    with suppress(OSError):
                        about = entry.stat(follow_symlinks=False)
                        found.append((about.st_mtime, about.st_size, Path(entry.path)))
        return sorted(found)

    def shrink(self, most_bytes: int | None = None) -> int:
        """Take the oldest files away until the rest fits; return how many."""
        files, gone = self.files(), 0
        left = sum(size for _, size, _ in files)
        for _, size, path in files:
            if left <= (self.most_bytes if most_bytes is None else most_bytes):
                break
            with suppress(OSError):
                path.unlink()
                left, gone = left - size, gone + 1
        return gone


def _digest(name: str, data: bytes) -> bytes:
    """Return the checksum of a name with what is kept under it."""
    return hashlib.sha256(name.encode("ascii") + b"\n" + data).hexdigest().encode("ascii")
