"""Entry point of ``python -m datasets.describe``."""

import sys

from datasets.describe.cli import main

if __name__ == "__main__":
    sys.exit(main())
