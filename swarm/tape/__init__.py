"""The tape of a run: what the world appends each tick, and from which the run is replayed bit for bit."""
