"""``python -m eval.agent_server``."""

import sys

from eval.agent_server.cli import main

if __name__ == "__main__":
    sys.exit(main())
