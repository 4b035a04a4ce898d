"""Capability: how wide the tolerance is beside the spread of what was cut, and what that number is worth."""
