"""Reports: what is to be handed over about a characteristic and a period – on paper, as a spreadsheet, as lines for a program.

content     what a report says, once; page, PDF, XLSX, CSV and JSON are renderings of it, so no two of them differ
queries     gathers it
drawing     the charts of the pages as lines and letters, for paper
files       PDF, XLSX, CSV, and many of them in one file
actions     many at once: asked for, made in the background, cancelled
making      the thread that makes them
"""
