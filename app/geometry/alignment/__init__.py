"""Alignment and set-up error: where the part lies, from touches, with pallets composed with parts."""
