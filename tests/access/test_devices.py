"""Devices of stations on record: what binds one, and what ends it."""

import pytest
from sqlalchemy import update
from sqlalchemy.orm import Session
from sqlalchemy.sql import func

from app.access.devices import CODE_LASTS, UNUSED, bind, device_of, devices, make_code, revoke
from app.access.tables import StationDevice
from app.errors import Invalid
from app.loop.tables.machines import Machine


@pytest.fixture
def code(session: Session) -> str:
    """A code for the only machine."""
    session.add(Machine(key="lathe-1", name="Lathe", control="other"))
    session.flush()
    return make_code(session, "lathe-1", "Tablet", "tests")


def refused(session: Session, code: str) -> bool:
    with pytest.raises(Invalid, match="not a code of this server"):
        bind(session, code)
    return True


def test_a_code_binds_one_device_to_its_machine(session: Session, code: str) -> None:
    device, token = bind(session, f" {code.lower()} ")
    assert (device.machine, device.name) == ("lathe-1", "Tablet")
    assert device_of(session, token) == device
    assert refused(session, code)
    assert device_of(session, code) is None


def test_a_code_that_was_revoked_binds_nothing(session: Session, code: str) -> None:
    (made,) = devices(session)
    revoke(session, made.id, "tests")
    assert refused(session, code)
    assert devices(session) == []


def test_a_code_lasts_half_an_hour(session: Session, code: str) -> None:
    session.execute(update(StationDevice).values(created_at=func.now() - CODE_LASTS))
    assert refused(session, code)
    assert devices(session) == []


def test_a_device_that_was_revoked_is_none(session: Session, code: str) -> None:
    device, token = bind(session, code)
    revoke(session, device.id, "tests")
    assert device_of(session, token) is None


def test_a_device_that_nobody_used_for_long_is_none(session: Session, code: str) -> None:
    _device, token = bind(session, code)
    session.execute(update(StationDevice).values(last_used_at=func.now() - UNUSED))
    assert device_of(session, token) is None
    assert devices(session) == []
