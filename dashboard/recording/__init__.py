"""Recorded runs: read again, and in numbers."""
