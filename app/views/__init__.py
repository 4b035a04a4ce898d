"""Pages that compose several rooms: plant, overview, characteristic, reports, set-up."""
