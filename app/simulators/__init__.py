"""Machines that are not there: for trying, for demonstrating, for tests and benchmarks.

    controls         one model of a machine, behind the protocol of each control
    demo             the demonstration plant, which calls the public API as real machines do
    simulate.py      ``inband bridge simulate``
    demonstrate.py   ``inband demo``
    trying.py        one lathe inside a plant that is empty otherwise

A distribution of its own, inband-simulators: the pyproject.toml beside this file builds the folder as the part ``app.simulators`` of
the Inband that is installed there. Nothing else in the house imports it; ``app.cli.simulators`` and
``app.views.plant.trying_pages`` look for it by name.
"""
