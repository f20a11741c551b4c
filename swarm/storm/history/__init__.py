"""What happened in a run of a storm, and what can be seen in it."""
