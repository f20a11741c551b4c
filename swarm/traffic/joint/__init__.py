"""Who asks for a joint plan, who leads, who stands, who enters after whom.

Imports `mapf`, `reservations`, `peers` and `lattice`.
"""
