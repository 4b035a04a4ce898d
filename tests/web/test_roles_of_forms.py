"""Forms of pages ask for the role that the API asks for."""

from fastapi.routing import APIRoute, iter_route_contexts

from tests.in_process import application
from tests.web.api_operations import operations

ROLES = ("viewer", "operator", "engineer", "admin")
# What a page's form does, by the operations of the API that do the same; None: there is none, or it is for everybody.
FORMS: dict[str, tuple[str, ...] | None] = {
    "/account/password": None,
    "/account/pin": None,
    "/simulated": ("add_machine",),
    "/simulated/remove": ("add_machine",),
    "/alarms/{number}/acknowledge": ("acknowledge_alarm",),
    "/alarms/{number}/affected": ("set_parts_aside",),
    "/alarms/{number}/photos": ("add_photo_of_alarm",),
    "/alarms/{number}/photos/{photo}/remove": ("remove_photo_of_alarm",),
    "/characteristics/{characteristic}/trial/start": ("start_correcting",),
    "/characteristics/{characteristic}/control-plan": ("set_control_plan",),
    "/characteristics/{characteristic}/temperature": ("set_expansion",),
    "/quarantines/{number}/parts/{part}/{what}": ("measure_part_again", "release_part", "scrap_part"),
    "/alignments/new": ("align",),
    "/alignments/pallets/new": ("compose_pallet",),
    "/alignments/{number}/acknowledge": ("acknowledge_alignment",),
    "/alignments/{number}/recompute": ("recompute_alignment",),
    "/calibration/{machine}/{memory}/{location}": ("calibrate_gauge", "calibrate_ring", "add_pair", "plan_calibration"),
    "/calibration/{machine}/{memory}/{location}/{what}/{number}": (
        "accept_calibration",
        "accept_suggestion",
        "exclude_pair",
    ),
    "/characteristics/{characteristic}/control/baselines/{version}/{what}": (
        "put_baseline_in_force",
        "retire_baseline",
    ),
    "/characteristics/{characteristic}/control/freeze": ("freeze_baseline",),
    "/characteristics/{characteristic}/readings/{sequence}/by-hand": ("add_hand_measurement",),
    "/characteristics/{characteristic}/readings/{sequence}/exclude": ("exclude_reading",),
    "/characteristics/{characteristic}/rules": ("put_rules",),
    "/characteristics/{characteristic}/what-if": ("propose_change",),
    "/corrections/{machine}/tools/{tool}": ("approve_corrections",),
    "/forms/new": ("measure_form",),
    "/forms/{form}/recompute": ("recompute_form",),
    "/gauges/new": ("add_gauge_study", "take_gauge_study"),
    "/gauges/{number}/correct": ("correct_gauge_study",),
    "/import": None,
    "/import/{token}": None,
    "/invitation/{token}": None,
    "/kinematics/machines/{machine}": ("plan_kinematics",),
    "/kinematics/machines/{machine}/backups/{version}": ("restore_kinematics",),
    "/kinematics/new": ("take_kinematics_run",),
    "/kinematics/runs/{run}/recompute": ("recompute_kinematics_run",),
    "/kinematics/runs/{run}/{what}": ("confirm_kinematics_run", "enter_kinematics_run", "undo_kinematics_run"),
    "/machines/{machine}/averages/{location}/edit": ("set_empirical_value",),
    "/machines/{machine}/connection/remove": ("remove_connection",),
    "/machines/{machine}/touch-tests": ("ask_for_touch_test",),
    "/machines/{machine}/touch-tests/{number}/answer": ("answer_touch_test",),
    "/machines/{machine}/touch-tests/{number}/stop": ("stop_touch_test",),
    "/machines/{machine}/corrections/program": ("mark_fetched", "confirm_corrections"),
    "/machines/{machine}/corrections/{number}": ("approve_correction", "release_correction", "reject_correction"),
    "/machines/{machine}/tools/{number}": ("describe",),
    "/machines/{machine}/tools/{number}/{what}": ("edit_tool", "change_tool", "switch_tool"),
    "/account/notifications": None,
    "/account/notifications/browser": None,
    "/setup/notifications/days-off": ("set_days_off",),
    "/setup/notifications/groups/new": ("add_receiver_group",),
    "/setup/notifications/groups/{group}": ("change_receiver_group", "delete_receiver_group"),
    "/setup/notifications/receivers": ("add_receiver",),
    "/setup/notifications/receivers/{receiver}/delete": ("delete_receiver",),
    "/setup/notifications/receivers/{receiver}/test": ("send_test",),
    "/setup/notifications/routes/new": ("add_notification_route",),
    "/setup/notifications/routes/{route}": ("change_notification_route", "delete_notification_route"),
    "/setup/reactions/new": ("add_reaction_plan", "add_reaction_picture"),
    "/setup/reactions/{plan}": ("change_reaction_plan", "withdraw_reaction_plan", "add_reaction_picture"),
    "/setup/reactions/catalogue": ("add_catalogue_entry",),
    "/setup/reactions/catalogue/{entry}": ("change_catalogue_entry",),
    "/notes/new": ("write_note",),
    "/maintenance/new": ("enter_maintenance",),
    "/maintenance/{number}/end": ("end_maintenance",),
    "/maintenance/{number}/extend": ("extend_maintenance",),
    "/notes/{number}/withdraw": ("withdraw_note",),
    "/proposals/{number}": ("approve_proposal", "reject_proposal", "withdraw_proposal"),
    "/reports": ("ask_for_reports",),
    "/reports/{number}/cancel": ("cancel_reports",),
    "/reports/{number}/throw-away": ("throw_reports_away",),
    "/setup/characteristics/new": ("add_characteristic",),
    "/setup/characteristics/{characteristic}": ("change_characteristic",),
    "/setup/characteristics/{characteristic}/forms": ("add_characteristic",),
    "/setup/machines/new": ("add_machine",),
    "/setup/machines/{machine}": ("change_machine",),
    "/setup/machines/{machine}/keys": ("make_machine_key",),
    "/setup/machines/{machine}/keys/{key}/revoke": ("revoke_machine_key",),
    "/setup/parameters": ("change_characteristic",),
    "/setup/people/invitations": ("invite_person",),
    "/setup/people/invitations/{token_hash}/withdraw": ("invite_person",),
    "/setup/people/keys": ("make_key",),
    "/setup/people/keys/{key}/revoke": ("revoke_key",),
    "/setup/people/{person}/password": ("change_person",),
    "/setup/people/{person}/{what}": ("change_person",),
    "/setup/programs": ("read_program",),
    "/setup/screens": ("add_wall_screen",),
    "/setup/screens/{screen}/revoke": ("revoke_wall_screen",),
    "/setup/stations": None,
    "/setup/stations/badges": None,
    "/setup/stations/badges/{person}/remove": None,
    "/setup/stations/{device}/revoke": None,
    "/sign-in": None,
    "/station": None,
    "/station/{machine}/alarms/{number}": None,  # on a device it is asked who acts: tests/views/station
    "/station/{machine}/alarms/{number}/photos": None,
    "/station/{machine}/context": None,
    "/station/{machine}/corrections/{number}": None,
    "/station/{machine}/note": None,
    "/station/{machine}/sizes": None,
    "/station/{machine}/tools/{number}/change": None,
    "/station/{machine}/tools/{number}/corrections": None,
    "/sign-out": None,
    "/signals/{number}": ("comment_signal",),
    "/work-zeros/fixtures/{machine}/{fixture}": ("watch_fixture",),
    "/work-zeros/new": ("find_work_zero",),
    "/work-zeros/{number}/acknowledge": ("acknowledge_work_zero",),
    "/work-zeros/{number}/recompute": ("recompute_work_zero",),
}


def test_a_page_asks_for_the_role_that_the_api_asks_for() -> None:
    """A form that does one of several things asks for the least of their roles, and its action for more where it must."""
    roles = {each.declared["operationId"]: each.declared.get("x-role") for each in operations()}
    differing = {}
    for context in iter_route_contexts(application().routes):
        route = context.original_route
        if not isinstance(route, APIRoute) or route.path.startswith("/api") or (route.methods or set()) <= {"GET"}:
            continue
        same = FORMS[route.path]
        if same is None:
            continue
        dependencies = route.dependant.dependencies
        inner = [
            each for dependency in dependencies for each in dependency.dependencies
        ]  # of the kit: who acts on what
        calls = [dependency.call for dependency in (*dependencies, *inner)]
        names = [getattr(call, "__name__", "") for call in calls]
        asked = {name.removeprefix("require_") for name in names if name.startswith("require_")}
        wanted = min((roles[name] for name in same), key=ROLES.index)
        if asked != {wanted}:
            differing[route.path] = (asked, wanted)
    assert differing == {}
