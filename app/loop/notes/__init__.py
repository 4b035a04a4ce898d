"""Notes: what a person writes down at a machine or a characteristic, at a moment. They stand on its charts."""
