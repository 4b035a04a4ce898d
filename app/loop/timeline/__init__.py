"""Events along time or along the readings of a characteristic, for every chart that has either as its axis."""
