"""What is known of a run, worked out from messages alone: pure. Imports no other sub-room."""
