"""From the way that is held to two wheel speeds: the aim, the tables, what limits them, and ways out."""
