"""``python -m world``: the same as ``swarm world``."""

import sys

from swarm.cli import main

if __name__ == "__main__":
    sys.exit(main(["world", *sys.argv[1:]]))
