"""Faults that a machine reports itself: battery of the probe, receiver, probe not ready."""
