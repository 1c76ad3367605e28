"""The command `mechdae bench` with other methods beside, and forces: ``python -m benchmarks``."""

from __future__ import annotations

import argparse

from benchmarks import alternatives, forces, integrators
from mechdae.cli.commands import bench


def main(words: list[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    bench.arguments(parser)
    parser.set_defaults(quiet=False)
    beside = bench.Beside(alternatives.alternatives, integrators.others, forces.measured)
    return bench.run(parser.parse_args(words), beside)


if __name__ == "__main__":
    raise SystemExit(main())
