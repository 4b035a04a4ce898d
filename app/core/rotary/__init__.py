"""Rotary axes: where they are beside where the control believes them, from a ball on the table (domain §9, cycle 452).

`sphere`: a ball's centre from touches; `axis`: the position errors of one rotary axis from ball centres; `results`: the
result parameters Q141 to Q149 and QS144 to QS146; `drift`: what has moved between runs. Lengths in mm, angles in degrees.
"""
