"""The process of robots: it joins a world, takes in senses and broadcasts, and sends each robot's answers."""
