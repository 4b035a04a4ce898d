"""Audit: every change by a person or a key, with before, after and why. Written once, never altered."""
