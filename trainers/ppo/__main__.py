"""``python -m trainers.ppo``."""

import sys

from trainers.ppo.cli import main

if __name__ == "__main__":
    sys.exit(main())
