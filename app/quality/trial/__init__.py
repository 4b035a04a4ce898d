"""Shadow trial: a characteristic that only measures, and the loop that would have corrected it."""
