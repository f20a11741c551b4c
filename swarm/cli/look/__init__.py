"""Commands that only look at a running fleet: its status, its events, what goes over the wire."""
