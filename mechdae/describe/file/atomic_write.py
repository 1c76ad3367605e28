"""Files that are written whole or not at all."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any


@contextmanager
def whole_file(path: Path) -> Iterator[Any]:
    """Open a file that is there when all of it is written, or as it was before.

    Raises
    ------
    OSError
        It cannot be written; the error names the file itself.
    """
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, "is a folder, not a file", str(path))
    partial = path.with_name(path.name + ".part")
    try:
        with partial.open("wb") as file:
            yield file
        partial.replace(path)
    except BaseException as error:
        partial.unlink(missing_ok=True)
        unnamed = isinstance(error, OSError) and error.errno and not error.filename
        if unnamed or getattr(error, "filename", None) == str(partial):
            error.filename = str(path)  # type: ignore[attr-defined]  # a full disk names nothing
        raise
