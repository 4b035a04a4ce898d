"""Maintenance: times in which people are not notified of the alarms of a machine, or of any. The alarms are raised as ever."""
