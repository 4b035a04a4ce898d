"""What a run of readings amounts to: its numbers, its spread, and the course that charts are drawn from."""
