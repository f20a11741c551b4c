"""Random worlds as plain data, run in one process and checked against laws, to find faults of the project."""
