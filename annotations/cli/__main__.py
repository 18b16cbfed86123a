"""``python -m annotations.cli …``: the same as ``annotations …``."""

import sys

from annotations.cli import main

sys.exit(main())
