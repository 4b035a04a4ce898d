"""The page of help that belongs to a page of the program."""

import re

_BEHIND: tuple[tuple[str, str], ...] = (
    # The first that fits the whole address counts.
    (r"/station/[^/]+/sizes", "how-to/sizes-by-hand"),
    (r"/station(/.*)?|/setup/stations", "how-to/stations"),
    (r"/alarms/[^/]+/affected|/quarantines(/.*)?", "how-to/quarantine"),
    (r"/alarms/load", "how-to/alarm-load"),
    (r"/alarms/causes|/setup/reactions(/.*)?", "how-to/reaction-plans"),
    (r"/alarms(/.*)?|/todo", "how-to/acknowledge-alarms"),
    (r"/corrections(/.*)?", "how-to/approve-corrections"),
    (r"/machines/[^/]+/corrections/program", "how-to/program-text"),
    (r"/machines/[^/]+/(tools|averages|corrections)(/.*)?|/tools", "how-to/change-tools"),
    (r"/connections|/machines/[^/]+/connection", "how-to/connections"),
    (r"/machines/[^/]+/touch-tests/.*", "how-to/bridge"),
    (r"/setup/notifications(/.*)?|/account/notifications|/maintenance(/.*)?", "how-to/notifications"),
    (r"/(setup/characteristics|characteristics)/[^/]+/program|/setup/programs", "how-to/program-text"),
    (r"/setup/machines(/.*)?", "how-to/connect-a-machine"),
    (r"/setup/(characteristics|parameters)(/.*)?", "how-to/set-up-a-characteristic"),
    (r"/setup/(people|audit)", "reference/words"),
    (r"/import(/.*)?", "how-to/import-readings"),
    (r"/characteristics/[^/]+/control(/.*)?|/count-charts", "how-to/control-charts"),
    (r"/characteristics/[^/]+/(rules|signals)|/signals/.*", "how-to/run-rules"),
    (r"/characteristics/[^/]+/(capability|six-pack)|/overview", "how-to/capability"),
    (r"/characteristics/[^/]+/(control-plan|sampling)", "how-to/control-plan"),
    (r"/characteristics/[^/]+/temperature", "how-to/temperature"),
    (r"/characteristics/[^/]+/trial(/.*)?", "how-to/shadow-trial"),
    (r"/ledger", "how-to/ledger"),
    (r"/shift", "how-to/shift"),
    (r"/wall|/setup/screens", "how-to/wall-screen"),
    (r"/characteristics/[^/]+/what-if|/proposals(/.*)?", "how-to/what-if"),
    (r"/characteristics/[^/]+/report|/reports", "how-to/reports"),
    (r"/characteristics/[^/]+/readings/.*", "reference/decision"),
    (r"/characteristics/[^/]+|/compare", "how-to/move-in-a-chart"),
    (r"/gauges(/.*)?", "how-to/gauge-studies"),
    (r"/calibration(/.*)?", "how-to/calibrate"),
    (r"/work-zeros(/.*)?", "how-to/work-zero"),
    (r"/alignments(/.*)?", "how-to/alignment"),
    (r"/forms(/.*)?", "how-to/form"),
    (r"/kinematics(/.*)?|/machines/[^/]+/geometry", "how-to/rotary-axes"),
    (r"/plants", "how-to/plants"),
    (r"/proof", "reference/statistics"),
)
_PATTERNS = [(re.compile(pattern), name) for pattern, name in _BEHIND]


def help_of(path: str) -> str:
    """The address of the page of help for a page; of one that has none of its own the contents.

    >>> help_of("/characteristics/shaft-d40/rules"), help_of("/machines/lathe-1/tools/3"), help_of("/account")
    ('/help/how-to/run-rules', '/help/how-to/change-tools', '/help')
    """
    name = next((name for pattern, name in _PATTERNS if pattern.fullmatch(path)), None)
    return f"/help/{name}" if name else "/help"
