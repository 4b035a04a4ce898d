"""Gauge studies: the share of the probe in the variation, entered, pasted or probed again and again."""
