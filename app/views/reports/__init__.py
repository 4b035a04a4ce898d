"""Reports on a characteristic and a period: on paper, as a spreadsheet, as lines for a program.

content     what a report says, once; page, PDF, XLSX, CSV and JSON are renderings of it, so no two of them differ
request     the period, the sections, the paper and the time zone of a report
queries     gathers its content
drawing     the charts of the pages as lines and text, for paper
files       PDF, XLSX, CSV, and many of them in one file
actions     many at once: asked for, made in the background, cancelled
worker      the thread that has them made
maker       the process that makes them
"""
