"""``python -m trainers.supervised``."""

import sys

from trainers.supervised.cli import main

if __name__ == "__main__":
    sys.exit(main())
