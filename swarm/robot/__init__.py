"""One robot: its brain, the fuzzy controller, kinematics, safety filter, mission, and the process that carries them."""
