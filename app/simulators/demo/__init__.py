"""The demonstration plant: three lathes and a milling machine that wear, warm up, scatter and now and then break something.

    plant.py       which machines, tools and features there are, and how a feature answers to its tool's offset
    simulation.py  the physics: pure, seeded, without a clock; it knows nothing of the server
    running.py     one machine in its loop: cut, measure, report, fetch corrections, apply them, confirm
    andon.py       the webhook that is notified
    duty.py        who is on duty, the days off, and maintenance
    people.py      who signs in, and the simulated operator who steps in when nobody else does

It talks to the server only through its public API: what it can do, a real machine can do.
"""
