"""What others have said, and who is silent or takes no part in traffic. Imports `lattice`."""
