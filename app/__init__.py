"""Inband: probe readings in, decisions out, tool-offset corrections back to the machine.

The map of the house, from the top floor down. A room knows only rooms of the floors below it, and of its own floor those that
stand lower in this list; import-linter holds that. Inside a room: tables (columns), queries (SELECT only), actions (load,
decide in core, save), schemas (JSON), api and pages (routes), wording (sentences), figures (pure: values in, charts out). Rooms meet
only through each other's queries and actions. frontend/ and migrations/ lie beside this folder, and inside it once installed.

    simulators       simulated controls, and the demonstration plant that calls the public API as real machines do;
                     a distribution of its own
    cli              the command `inband`
    main.py          create_app(): the wiring

    plants           several plants in one installation: their list, their addresses, their overview

    views            pages that compose several rooms
        help             the documents of docs/ as pages of the program
        licences         what runs here of others, with its terms; the bill of materials
        reports          a characteristic and a period as page, PDF, spreadsheet; many at once in the background
        search           readings and parts across characteristics, one field for everything
        compare          several characteristics, versions, tools or periods side by side
        wall             the wall screen: machines, alarms, parts of the shift, from five metres, by a key of its own
        shift            one shift: parts, alarms and how fast they were acknowledged, corrections, what comes next
        alarm_load       rates, floods, chattering and stale alarms by ISA-18.2, and the ten noisiest
        overview         every characteristic ranked by what needs attention, with the reasons
        to_do            everything that waits for a person, with one count
        approvals        corrections that wait for a person
        station          one machine on the tablet beside it, readable from two metres
        plant            the first page: every machine and characteristic at a glance
        characteristic   one characteristic: zone chart, decisions, capability
        set_up           machines, characteristics, people, programs, the record, background jobs
    quality          judgement of processes and of measuring systems
        temperature      drift by temperature, by warming up after a pause, and by wear, with what cannot be separated
        sampling         how many parts need not be measured, with the risk of it
        trial            a characteristic that only measures, and the loop that would have corrected it
        ledger           what corrections were worth: rejects prevented and caused, in pieces and in money
        what_if          stored readings replayed with other settings, maps of them, proposals of changes
        gauge_studies    Cg, R&R, linearity, bias, and their advice for R33
        capability       Cp to Ppk with intervals, normality, behaviour in time, the process without its corrections
        control_charts   control charts by frozen baselines, with the signals of run rules
        count_charts     charts of counts, such as p, np, c and u; nothing is stored
        chart_signals    signals that rules gave, once a minute: kept, explained, raised as alarms
        chart_rules      run rules: which watch which chart, and how often each fires
        baselines        baselines frozen on purpose, and the readings as points that they judge
        wear             true wear behind the corrections, remaining tool life, loops that hunt
        proof            published examples run through the live engine, beside the published results
    geometry         results of probed points
        alignment        the set-up error of a part: frame, residuals, values to enter
        work_zero        work zero and size from an edge finder's points, and how a fixture shifts
        geometric_form   form and position: roundness, flatness, position, with uncertainty
        rotary_axes      preset compensation of rotary axes, drift, back-ups of the kinematics
    loop             the compensation loop
        reactions        what to do at which alarm, causes and corrective actions to choose from, causes by frequency
        notifications    who is notified of which alarm, by mail, webhook or apprise; deliveries on record
        summaries        counts, standard deviations, charts of ten million points
        control_plan     how often each characteristic is measured, and measurements that were missed
        present_context  the order, batch … that a machine works at, put on readings that bring temperatures at most
        calibration      empirical values: against a gauge, in a ring, by pairs; calibrations that are due
        faults           faults that a machine reports about itself and its probe
        connections      heartbeats of the bridges beside the machines, and those that fall silent
        quarantine       parts that an alarm concerns, set aside until each is released or scrapped
        alarm_response   the list of alarms, acknowledgement and what follows from it
        tools            tool memory (R10), average memory (R11), corrections and their life
        programs         program text of the controls: read, written
        timeline         events along time or readings on every chart: alarms, tool changes, calibrations, versions
        notes            what a person writes down at a machine or a characteristic, at a moment
        maintenance      times in which no notifications of a machine's alarms, or of all, are sent
        alarms           kinds of alarms, raised once
        readings         the door: probe readings come in, are decided, stored and answered together
        expansion        thermal expansion of characteristics, sizes at 20 °C beside the measured ones
        characteristics  nominal, limits, and the versions of the R parameters
        warnings         implausible values that a person acknowledges before a machine gets them
        machines         machine tools, their keys, the lock that orders everything that happens on one machine
        tables           the tables of the loop: one schema under one lock
    access           people, sign-in, sessions, roles, keys, the record of changes

    bridge           the program beside machines that cannot speak REST; it speaks the public API like any client
    web              the browser kit: templates, problem pages, live events
    files            file formats in and out; reports as picture, PDF, spreadsheet, CSV, JSON
    charts           what a chart shows, described once; drawn in the browser and on paper
    jobs             periodic background jobs, once a minute: run, retried, and those that fail
    db               PostgreSQL: engine, column types, migrations, the embedded server
    language         translation, and the writing of numbers, units and times
    client           inband_client, which programs beside the machines call a server with; a distribution of its own
    core             the decisions themselves, pure: parameters R10-R37, zones, running average, statistics, geometry

    errors.py        every error that people or machines may see
    logs.py          the server's log
    memory.py        free memory given back to the system
    settings.py      every setting with its meaning; unsafe values are refused
"""

import os
from pathlib import Path

# The matrices here are small. Threads of the linear algebra would take longer, and the processors from PostgreSQL. Set before
# NumPy is imported; who sets it themselves keeps it.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

__version__ = "0.1.0"

_HERE = Path(__file__).resolve().parent
HOUSE = _HERE if (_HERE / "frontend").is_dir() else _HERE.parent
"""The folder that holds ``frontend/``, ``migrations/`` and ``docs/``: this one where a wheel is installed, else the tree's."""
