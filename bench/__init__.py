"""Benchmarks: each prints ratios measured side by side in one run on one machine. ``python -m bench.single`` and so on.

Some print plain numbers: `bench.soak` a curve, `bench.pages` times and sizes unless it is told of another version.
"""
