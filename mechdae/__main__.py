"""``python -m mechdae``."""

import sys

from mechdae.cli import console

sys.exit(console())
