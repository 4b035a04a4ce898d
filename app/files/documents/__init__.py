"""A report as values, and what it is written on: pictures, PDF, spreadsheet, CSV, JSON. Pure; knows no part of the shop floor.

content    what any report says: values with units, facts, tables, charts
files      PDF, XLSX, CSV
schemas    JSON
"""
