"""The state of the world as a file."""
