"""``python -m eval.study``."""

import sys

from eval.study.cli import main

if __name__ == "__main__":
    sys.exit(main())
