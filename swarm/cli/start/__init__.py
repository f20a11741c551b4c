"""Commands that run a whole fleet on this machine, or one process of a fleet, and make its keys."""
