"""Translation, and the writing of numbers and units."""
