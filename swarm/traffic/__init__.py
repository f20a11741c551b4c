"""Traffic: which robot may enter which cell, and when."""
