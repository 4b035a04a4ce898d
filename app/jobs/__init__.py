"""Periodic background jobs: what is done once a minute although nobody asks, one unit of work at a time.

A job lists what is due (`PeriodicJob.due`) and does one unit of it (`PeriodicJob.do`): a characteristic, a tool, a place.
Each unit has a transaction of its own. One that fails is rolled back, recorded, logged with what it concerns, and tried
again after pauses that grow from one minute to one hour; the others go on. Its record ends when it succeeds, or is not due
any more. Each part of the shop floor offers its jobs, `app.main.JOBS` names them.
"""
