"""What the fork server does once before any fork, so that all processes share its memory pages: imports, a rehearsal.

This module opens no session and starts no thread: a fork would break them.
"""

import json
import os
from contextlib import suppress
from pathlib import Path

from swarm import garbage, kernels
from swarm.errors import SwarmError
from swarm.launch.supervise.fleet import SOURCE
from swarm.launch.supervise.rehearsal import rehearse_mission
from swarm.scenario.source import Source
from swarm.stop_signal import leave_terminal_to_parent

leave_terminal_to_parent()

kernels.load()
if SOURCE in os.environ:
    file, scen, robots, serve = json.loads(os.environ.pop(SOURCE))
    with suppress(SwarmError):  # the launcher reads the same files and says what is wrong with them
        rehearse_mission(Source(Path(file), None if scen is None else Path(scen), robots, serve))
garbage.collect_seldom()  # and it does not touch the shared pages again
