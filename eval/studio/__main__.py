"""Entry point of ``python -m eval.studio``."""

import sys

from eval.studio.cli import main

if __name__ == "__main__":
    sys.exit(main())
