"""Reduced models: linear-elastic response and a learned correction in a few modes (docs/reference/reduced.md)."""
