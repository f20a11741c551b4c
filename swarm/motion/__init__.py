"""Kinematics: the differential drive, and compiled predictions of where wheel commands lead."""
