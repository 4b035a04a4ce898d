"""How edges wear behind the corrections, how long they will do, and whether a loop runs after its own scatter."""
