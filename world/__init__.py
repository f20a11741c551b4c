"""The shared world: physics, sensing, the radio model, the clock, and the process that runs them."""
