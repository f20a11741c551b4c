"""The floor as cells: where a robot can stand, which cells are joined, how far it is. Imports no other sub-room."""
