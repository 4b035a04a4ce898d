"""Overview: every characteristic ranked by its need for attention: state, signals, capability, wear, load of alarms."""
