"""``python -m eval.live``."""

import sys

from eval.live.cli import main

if __name__ == "__main__":
    sys.exit(main())
