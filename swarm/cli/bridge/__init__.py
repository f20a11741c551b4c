"""The command `swarm bridge`, a file for each of the other worlds of robotics to which it shows a fleet."""
