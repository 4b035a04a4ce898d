"""Stored readings replayed with other settings, and the changes of parameters that are proposed from it."""
