"""Baselines: what readings are judged by, frozen on purpose, and the readings as the points that they judge."""
