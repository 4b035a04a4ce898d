"""AQDEF files (Q-DAS ASCII transfer format): what each field means, read and written. Nothing of the server is known here.

fields.py       the one table of K fields: meaning, unit, length, what it is here when read, what fills it when written
description.py  what a file describes: parts, characteristics, catalogues; its encoding
values.py       its values one after the other, what they mean, and their keys
times.py        the spellings of times
context.py      the circumstances of a value, as the contract has them
writer.py       a file written

`app.loop.readings.aqdef` stores what a file holds and exports readings.
"""
