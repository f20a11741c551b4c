"""The state of the world as messages and as a report; it changes nothing."""
