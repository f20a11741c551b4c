"""Plans of storms: drawn, read, made simpler. Imports nothing else of the storm."""
