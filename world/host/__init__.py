"""The world's process: wait, answer, step, save. Imports all sub-rooms of the world but `storm`."""
