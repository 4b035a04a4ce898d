"""Everything that waits for a person, with one count."""
