"""Approvals: corrections that wait for a person, and what may be done with them."""
