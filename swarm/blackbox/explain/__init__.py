"""What a robot does at a tick of a run that is run again, and why: its whole state, and the chain of causes."""
