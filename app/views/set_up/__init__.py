"""Set-up: the pages where machines, keys, characteristics and people are made and changed."""
