"""Gauge studies: what of the scatter is the gauge's own.

    single         type 1 (Cg, Cgk) and bias: one reference, measured again and again
    linearity      bias at several references, and how it grows with size
    crossed        gauge R&R: every operator measures every part several times, by ANOVA and by average and range
    zero_range     what repeatability says about a sensible R33

Sources: AIAG, Measurement Systems Analysis, 4th edition; VDA 5; ISO 22514-7.
"""
