"""Calibration: what the machine reads too much, from a gauge (L92), a ring on the spindle, or an external gauge."""
