"""Who is there, and what all are told."""
