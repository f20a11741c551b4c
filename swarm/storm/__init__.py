"""Random worlds as plain data, run in one process and judged by laws: how the project finds its own faults."""
