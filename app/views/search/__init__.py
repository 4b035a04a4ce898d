"""Search: readings across characteristics and machines, everything measured on a part, and one field for all that has a name."""
