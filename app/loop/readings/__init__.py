"""Readings: the one door through which data comes in. Numbered without gaps, decided, stored once, answered after the commit."""
