"""Geometry by probing: work zero, alignment, geometric form, rotary axes."""
