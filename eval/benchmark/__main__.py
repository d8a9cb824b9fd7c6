"""``python -m eval.benchmark``."""

import sys

from eval.benchmark.cli import main

if __name__ == "__main__":
    sys.exit(main())
