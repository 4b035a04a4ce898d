"""Tables of the loop: one schema under one lock per machine, so they stand together and below its rooms."""
