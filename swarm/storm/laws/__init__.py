"""The laws that each run of a storm is held against. Imports `history` and `plans`."""
