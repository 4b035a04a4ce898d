"""Tables of the loop: one schema under one lock per machine, so they are together and below its rooms."""
