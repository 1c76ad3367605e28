"""``mechdae schema``."""

from __future__ import annotations

import argparse
import json


def arguments(parser: argparse.ArgumentParser) -> None:
    del parser


def run(options: argparse.Namespace) -> int:
    del options
    from mechdae.describe.file.schema import compact, schema

    print(json.dumps(compact(schema()), ensure_ascii=False, separators=(",", ":")))
    return 0
