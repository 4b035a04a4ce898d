"""Quarantine: parts that an alarm concerns, set aside, and what becomes of each. What is certainly good: `app.core.affected`."""
