"""A shift of the plant: parts, alarms and how fast they were answered, corrections, tool changes, what needs attention next."""
