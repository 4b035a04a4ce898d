"""Inband: probe readings in, decisions out, tool-offset corrections back to the machine.

The map of the house. Whoever knows the shop floor knows where to look:

    core             the decisions themselves, pure: parameters R10-R37, zones, running average, decide()
    machines         machine tools, their keys, the lock that serialises what happens on one machine
    characteristics  what is measured: nominal, limits, and the versions of the R parameters
    readings         the door: probe readings come in, are decided, stored and answered together
    offsets          tool memory (R10), average memory (R11), corrections and their life
    alarms           what needs a person, and what follows when one acknowledges it
    calibration      empirical values: against a gauge, in a ring, by pairs; what is due
    plant            the first page: every machine and characteristic at a glance
    overview         every characteristic ranked by what needs attention, with the reasons
    statistics       what the readings say together: counts, spread, charts of ten million points
    wear             true wear behind the corrections, how long an edge will do, and loops that hunt
    control          control charts by frozen baselines, run rules and their signals
    whatif           stored readings replayed with other settings, maps of them, proposals of changes
    reports          a characteristic and a period as page, PDF, spreadsheet; many at once in the background
    capability       Cp to Ppk with intervals, normality, behaviour in time, the tool without its corrections
    gauges           gauge studies: Cg, R&R, linearity, bias, and what they say about R33
    forms            form and position from touches: roundness, flatness, position, with uncertainty
    zeros            work zero and size from an edge finder's touches, and how a fixture shifts
    alignments       the set-up error of a part: frame, residuals, what to enter
    kinematics       rotary axes: runs of the preset compensation, drift, back-ups of the kinematics
    proof            published examples run through the live engine: what it says, what was published
    setup            the pages where all of that is set up
    people           who may do what: sign-in, sessions, roles, personal keys
    audit            who changed what, from what, to what, and why
    programs         program text of the controls: read, written, corrections fetched as text
    formats          files in and out
    paper            what a report says as values, and how it is written: picture, PDF, spreadsheet, CSV, JSON
    demo             a simulated plant that talks to the public API like real machines do

    web              the browser kit: templates, problem pages, live events, translation
    db               PostgreSQL: engine, column types, migrations, the embedded server
    cli              the command `inband`
    rounds.py        what has to be looked after although nobody asks, once a minute
    settings.py      every setting with its meaning; unsafe values are refused
    errors.py        every error that people or machines may see
    main.py          create_app(): the wiring

A part holds at most: tables (columns), queries (SELECT only), actions (load, decide in core, save),
schemas (JSON), api and pages (routes), figures (pure, charts as dicts). Parts meet only through each
other's queries and actions. frontend/ and migrations/ lie beside this folder.
"""

__version__ = "0.1.0"
