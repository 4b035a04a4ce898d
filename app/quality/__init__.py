"""Judgement of processes: control charts, capability, gauge studies, wear, what-if, published proof."""
