"""Machines: who pushes readings and fetches corrections. One lock per machine orders everything that happens to it."""
