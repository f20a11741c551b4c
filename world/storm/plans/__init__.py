"""Plans of storms: drawn, read, made simpler. Imports nothing of the storm but the search of `history`."""
