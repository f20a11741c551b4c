"""What the rays show that neither the map nor a robot explains. Imports `reservations`, `peers` and `lattice`."""
