"""The numbers the documentation states, each made anew by a command: ``python -m benchmarks.<name>``."""
