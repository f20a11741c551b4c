"""The tables of ``benchmarks.scale`` that stand on more than a fleet's own run."""
