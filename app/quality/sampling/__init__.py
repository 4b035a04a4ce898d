"""Sampling: how many parts need not be measured, with the risk of it and the seconds that it saves."""
