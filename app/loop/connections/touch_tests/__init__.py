"""Touch tests of tool locations: people ask and answer, the bridge reads, writes and takes back."""
