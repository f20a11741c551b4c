"""Who goes first where robots meet."""
