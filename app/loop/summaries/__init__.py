"""Summaries of a window of readings: statistics, histogram, and the blocks that charts are drawn from."""
