"""Files in and out, one module for each kind. They know of cells, lines, numbers and times, not of readings."""
