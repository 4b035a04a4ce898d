"""Work zero and size from the touches of an edge finder or probe, and whether the fixture shifts."""
