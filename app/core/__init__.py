"""The core: what a probe reading means and what follows from it.

Pure functions of their arguments: no clock, no input or output, no randomness, no logging.
Standard library, NumPy, SciPy and Numba only, so that every verdict can be had in a REPL::

    >>> from app.core.decision.decide import LoopState, decide
    >>> from app.core.parameters import Parameters
    >>> p = Parameters(target=39.992, tolerance_width=0.016, zero_range=0.001, averaging_limit=0.0053,
    ...                wear_limit=0.3, confidence_limit=1.0, weighting_factor=2, factor=-1, tool_memory=3)
    >>> decision = decide(p, LoopState(average=0.0012), deviation=0.0061)
    >>> decision.zone.value, decision.action.value, decision.amount
    ('full', 'correct', -0.0061)
"""
