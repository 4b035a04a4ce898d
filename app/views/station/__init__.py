"""Station view: one machine on the tablet beside it, readable from two metres."""
