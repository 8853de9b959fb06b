"""Reduced models: the linear-elastic response of a mesh and a learned correction in a few modes (docs/reduced.md)."""
