"""Benchmarks: each prints ratios measured side by side in one run on one machine. ``python -m bench.single`` and so on."""
