"""The writer: the way of readings into the database."""
