"""The bridges, and what others see through them."""
