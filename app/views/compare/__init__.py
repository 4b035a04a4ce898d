"""Compare: several characteristics, or versions, tools and periods of one, on charts of one scale with their statistics."""
