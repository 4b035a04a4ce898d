"""The decision on a reading: limits and their border rule, the arithmetic, `decide`, and the loops over columns.

`limits` and `step` hold every comparison and every calculation, once. `decide` puts words to them; `loops` runs the same
functions compiled over many readings. Nothing but `loops` imports Numba.
"""
