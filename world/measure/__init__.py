"""What the world measures by itself: it trusts no robot. Imports `bodies`."""
