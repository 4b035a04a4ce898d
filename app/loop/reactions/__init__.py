"""Reaction plans: what to do at which alarm, the catalogue of causes and corrective actions, and which causes come how often."""
