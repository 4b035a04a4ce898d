"""AQDEF files in and out: several characteristics in each, which may be set up out of the file.

matching.py   what the file's characteristics are: lengths in mm, limits, and which of them are known here
sorting.py    the values of each put down beside, with keys of their own, or what is wrong with them
content.py    those values as readings
export.py     readings written
api.py        both as JSON routes
form.py       what is chosen on the page
actions.py    set up what is missing, store as history, exclude what the file marks, remember what belongs together
"""
