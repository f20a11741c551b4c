"""The bridge to Foxglove: a fleet live in its viewers, and as bags. Nothing outside this package imports foxglove."""
