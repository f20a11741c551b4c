"""The replay of a run from its tape: any tick with all that every robot knew, what differs, and why a robot waits."""
