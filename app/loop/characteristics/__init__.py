"""Characteristics: the dimensions that are kept in their band, each with its versioned parameters."""
