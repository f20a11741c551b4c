"""How robots move: the differential drive, and where wheels lead, compiled."""
