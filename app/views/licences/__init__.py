"""Everything of others that runs here: as a page with the licence texts, and as a bill of materials."""
