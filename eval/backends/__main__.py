"""``python -m eval.backends``."""

import sys

from eval.backends.cli import main

if __name__ == "__main__":
    sys.exit(main())
