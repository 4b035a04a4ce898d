"""Drift of sizes by temperature, by warming up after a pause, and by wear."""
