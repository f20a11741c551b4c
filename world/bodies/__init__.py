"""What moves, touches and is sensed. Imports no other sub-room of the world."""
