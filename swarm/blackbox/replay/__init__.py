"""The replay of a run from its tape, in one process: every robot answers again, and what differs is named."""
