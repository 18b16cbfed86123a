"""``python -m annotations.cli …``: the same as ``annotations …``."""

import sys

from annotations.cli import main

if __name__ == "__main__":
    sys.exit(main())
