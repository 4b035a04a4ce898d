"""What needs attention first: every characteristic ranked by its state, signals, capability, wear and load of alarms."""
