"""Wear of edges behind the corrections, remaining tool life, and loops that over-correct."""
