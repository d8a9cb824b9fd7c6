"""``python -m eval.clean``."""

import sys

from eval.clean.cli import main

if __name__ == "__main__":
    sys.exit(main())
