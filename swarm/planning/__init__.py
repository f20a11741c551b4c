"""Paths for one robot alone: the grid, A*, and a checker that knows nothing of A*."""
