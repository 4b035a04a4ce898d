"""Alarms: what needs a person, what that person did about it, and what followed."""
