"""The compensation loop: machines, characteristics, readings, tools, alarms, calibration, programs, summaries."""
