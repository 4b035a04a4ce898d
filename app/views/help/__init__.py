"""Help: the documents of `docs/` as pages of the program, and the sections of them that search finds."""
