"""Response to alarms: the list, their words, acknowledgement and what follows from it."""
