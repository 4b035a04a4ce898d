"""Pages that search finds by their name or by a word of the glossary, with the role that each needs."""

from typing import NamedTuple

from app.access.callers import Role
from app.language.i18n import _


class Door(NamedTuple):
    """A page: its title, its path, and words that lead to it as well."""

    title: str
    path: str
    words: str
    role: Role = "viewer"


def doors() -> list[Door]:
    """All pages that stand by themselves, in the reader's language."""
    return [
        Door(_("Plant"), "/", _("all machines, state now")),
        Door(_("To do"), "/todo", _("what waits for a person, open tasks")),
        Door(_("Alarms"), "/alarms", _("acknowledge, tool worn, probe fault")),
        Door(_("History of alarms"), "/alarms/history", _("acknowledged alarms")),
        Door(
            _("Alarm load"),
            "/alarms/load",
            _("ISA-18.2, IEC 62682, alarm flood, chattering, stale, nuisance alarms, top ten"),
        ),
        Door(_("Causes of alarms"), "/alarms/causes", _("Pareto, time to acknowledge, time to recover")),
        Door(_("Maintenance"), "/maintenance", _("silence, downtime, service, nobody is notified, mute, planned")),
        Door(_("Quarantines"), "/quarantines", _("parts set aside, affected parts, release, scrap, containment")),
        Door(_("Approvals"), "/corrections", _("corrections that wait, approve, held")),
        Door(_("Proposals"), "/proposals", _("proposed parameters, what-if")),
        Door(
            _("Quality"),
            "/overview",
            _("ranking, statistics, Cp, Cpk, Pp, Ppk, capability, control charts, run rules, what-if"),
        ),
        Door(
            _("Charts of counts"),
            "/count-charts",
            _("p, np, c, u, Laney, attributes, rejected parts, nonconformities; counts are typed in, not stored"),
        ),
        Door(_("Compare"), "/compare", _("side by side, small multiples, before and after, versions, tools, periods")),
        Door(
            _("Ledger"), "/ledger", _("savings, what corrections were worth, cost of rejects, money, over-correction")
        ),
        Door(_("Shift"), "/shift", _("shift report, handover, parts of the shift, how fast alarms were acknowledged")),
        Door(_("Gauge studies"), "/gauges", _("Cg, Cgk, %GRR, ndc, R&R, bias, linearity, measuring system, MSA")),
        Door(_("Reports"), "/reports", _("PDF, spreadsheet, XLSX, CSV, hand over")),
        Door(_("Find a part"), "/parts", _("serial number, part")),
        Door(_("Machines"), "/machines", _("tool memory, R10, average memory, R11, connections")),
        Door(_("Notes"), "/notes", _("what people wrote down, comment, remark, log")),
        Door(
            _("Calibration"), "/calibration", _("probe calibration, ring, empirical value, gauge, measuring error, due")
        ),
        Door(_("Work zero"), "/work-zeros", _("edge finder, fixture, vice, G54, origin")),
        Door(_("Alignment"), "/alignments", _("frame, rotation, set-up error, pallet, residual")),
        Door(_("Form and position"), "/forms", _("roundness, flatness, straightness, cylindricity")),
        Door(_("Rotary axes"), "/kinematics", _("kinematics, preset compensation, cycle 452, calibration sphere")),
        Door(_("Characteristics, set-up"), "/setup/characteristics", _("R parameters, nominal, limits, tolerance")),
        Door(_("Change many characteristics"), "/setup/parameters", _("bulk, one parameter of many, R33"), "engineer"),
        Door(_("Machines, set-up"), "/setup/machines", _("keys, control, copy")),
        Door(_("Import readings"), "/import", _("CSV, XLSX, workbook, spreadsheet, history"), "engineer"),
        Door(_("Program text"), "/setup/programs", _("read a program, Sinumerik, Fanuc, Heidenhain")),
        Door(_("People"), "/setup/people", _("invite, role, user, password"), "admin"),
        Door(_("Record of changes"), "/setup/audit", _("audit trail, who changed what"), "engineer"),
        Door(_("Wall screens"), "/setup/screens", _("big screen in the hall, andon, dashboard, kiosk"), "admin"),
        Door(_("Reaction plans"), "/setup/reactions", _("steps, causes, corrective actions, catalogue"), "engineer"),
        Door(
            _("Notifications"),
            "/setup/notifications",
            _("mail, webhook, escalation, quiet hours, on call, groups, rota, days off, holidays"),
            "admin",
        ),
        Door(_("Background jobs"), "/setup/jobs", _("periodic jobs, failing"), "engineer"),
        Door(_("Proof"), "/proof", _("published examples, validation")),
        Door(_("Licences"), "/licences", _("libraries, versions, SBOM, open source")),
        Door(_("Help"), "/help", _("manual, instructions, how-to, documentation")),
        Door(_("Glossary"), "/help/reference/glossary", _("terms, R numbers, abbreviations")),
        Door(_("Account"), "/account", _("password, sign out")),
        Door(_("API"), "/api/docs", _("REST, OpenAPI, program")),
    ]
