"""Maps people already have, loaded into one kind of grid."""
