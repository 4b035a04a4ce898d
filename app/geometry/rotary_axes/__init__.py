"""Rotary axes: runs of the preset compensation (cycle 452), what they ask to enter on the control, and how the axes drift."""
