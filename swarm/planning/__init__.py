"""Path planning for a single robot: the grid, A*, and a path checker that shares no code with A*."""
