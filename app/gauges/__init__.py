"""Gauge studies: what of the scatter is the probe's own, entered, pasted or probed again and again."""
