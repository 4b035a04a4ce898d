"""Signals that run rules gave: kept, explained, and raised as alarms."""
