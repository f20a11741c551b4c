"""Bridges: a fleet as other worlds of robotics see it. A bridge is an ordinary client of the wire."""
