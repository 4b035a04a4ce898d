"""Maintenance: times in which no notifications of the alarms of a machine, or of all, are sent. The alarms are raised as ever."""
