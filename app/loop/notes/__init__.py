"""Notes: what a person writes down at a machine or a characteristic, at a moment. They are on its charts."""
