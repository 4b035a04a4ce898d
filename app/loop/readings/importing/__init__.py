"""Readings out of files: measured earlier, elsewhere, by something that cannot call the API.

    layout.py     what a file's columns mean: guessed from its header, or said
    lines.py      its lines as readings, or what is wrong with each
    history.py    the past: judged and stored, corrects nothing (the default)
    actions.py    the two ways in, and what they come to

The past must not act on the machine of today. A correction computed from a part of last March would scrap the parts of this
morning; an alarm about it would call an operator to a tool that is long gone; its probe fault would pause today's
compensation. So imported readings are judged by the parameters in force, with a running average of their own, and say so
(code `imported`); M, tool memory, alarms and pauses stay as they are. `live=True` sends them through the same door as any
reading, for a machine that can only write files.
"""
