"""Which cells a robot holds, and how a claim becomes a hold. Imports `peers` and `lattice`."""
