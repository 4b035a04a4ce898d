"""Run rules: which of them watch which chart of a characteristic, and how often each fires."""
