"""``mechdae cache``: what is kept on disk between processes."""

from __future__ import annotations

import argparse

from mechdae.errors import InputError
from mechdae.kernels.stored.folder import VARIABLE, Folder, place


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--clear", action="store_true", help="take all of it away")


def run(options: argparse.Namespace) -> int:
    path = place()
    if path is None:
        print(f"nothing is kept on disk ({VARIABLE}=0)")
        return 0
    folder = Folder(path)
    if fault := folder.fault:
        raise InputError(f"the folder {fault}", where=str(path), hint=f"{VARIABLE}=FOLDER")
    if options.clear:
        gone = folder.shrink(-1)
        if not options.quiet:
            print(f"{gone} kernels taken away from {path}")
        return 0
    files = folder.files()
    size = sum(size for _, size, _ in files) / 1e6
    print(
        f"{path}: {len(files)} kernels, {size:.1f} MB of at most {folder.most_bytes / 1e6:.0f} MB"
    )
    return 0
