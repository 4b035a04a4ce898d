"""Offsets: tool memory R10, average memory R11, and the corrections that go from here to the machine."""
