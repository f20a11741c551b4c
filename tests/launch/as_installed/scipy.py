"""In the way of scipy, which no installation of a user has: it is an oracle of the tests. numba would import it."""

raise ModuleNotFoundError("No module named 'scipy'", name="scipy")
