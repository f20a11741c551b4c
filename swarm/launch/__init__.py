"""Processes of a fleet on this machine: starts, watches, restarts, ends them. It coordinates nothing."""
