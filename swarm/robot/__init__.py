"""One robot: its decisions, path, driving, safety filter and mission, and the process that runs them."""
