"""``python -m mechdae``."""

import sys

from mechdae.cli import main

sys.exit(main())
