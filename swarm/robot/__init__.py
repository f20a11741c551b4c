"""One robot: its brain, the fuzzy controller, kinematics, supervisor, mission, and the process that carries them."""
