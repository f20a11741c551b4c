"""Robots, the radio between them, and the commands that launch and steer a fleet."""
