"""Reduced models: linear-elastic response and a learned correction in a few modes (docs/results/reduced.md)."""
