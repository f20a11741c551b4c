"""The launcher: it starts, watches, restarts and ends the processes of a fleet on this machine, and no more."""
