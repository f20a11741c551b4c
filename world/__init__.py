"""The shared world: physics, sensing, the ether, the clock, and the process that carries them."""
