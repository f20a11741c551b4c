"""Plans for many agents on a graph: no robot, no radio, no metre. Imports nothing of ours."""
