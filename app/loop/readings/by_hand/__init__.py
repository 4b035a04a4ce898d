"""Measurements by hand, with a micrometer or a plug gauge, beside the machine's own value of the same part."""
