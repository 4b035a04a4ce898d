"""Present context: the order, batch, fixture … that a machine works at, put on readings that bring no context but temperatures."""
