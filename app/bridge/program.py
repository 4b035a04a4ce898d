"""The whole program: all machines of a configuration, each with its own tasks."""

import asyncio
import contextlib
import logging
import ssl
from pathlib import Path

from app import memory
from app.bridge import control_side, offset_change, proving_by_page, server_side
from app.bridge.configuration import Configuration, Machine
from app.bridge.kinds import kind_named
from app.bridge.kinds.mtconnect import Context
from app.bridge.links import Link
from app.bridge.store import Store
from app.bridge.store_lock import StoreError
from app.bridge.unit import Unit, ended
from app.bridge.wire import Wire
from inband_client import AsyncClient

log = logging.getLogger(__name__)
TIDY_EVERY = 600.0  # s


def link_of(machine: Machine) -> Link:
    """The link to a machine's control."""
    link: Link = kind_named(machine.kind).link(machine)
    return link


def store_of(configuration: Configuration) -> Store:
    """The store that the configuration names. Raises `StoreError`."""
    return Store(Path(configuration.store.file), configuration.store.largest)


async def run(configuration: Configuration, store: Store) -> None:
    """Run all machines until cancelled."""
    for words in configuration.warnings:
        log.warning("%s", words)
    trusted = ssl.create_default_context(cafile=configuration.server.ca)  # one for all: each costs a megabyte
    async with contextlib.AsyncExitStack() as stack:
        wire = Wire(trusted)
        stack.callback(wire.close)
        tasks, units = [], []
        for machine in configuration.machines:
            client = await stack.enter_async_context(
                AsyncClient(configuration.server.url, machine.secret, verify=trusted, patience=0.0, transport=wire)
            )
            unit = Unit(machine, link_of(machine), store, configuration.hold_all)
            units.append(unit)
            if machine.context is not None:
                unit.context = Context(machine.key, machine.context)
                tasks.append(asyncio.create_task(unit.context.run(), name=f"{machine.key} context"))
            for name, work in (
                ("control", control_side.run(unit)),
                ("server", server_side.run(unit, client, configuration.server)),
                ("heartbeat", server_side.beat(unit, client, configuration.server)),
                ("touch test", proving_by_page.run(unit, client)),
            ):
                tasks.append(asyncio.create_task(work, name=f"{machine.key} {name}"))
        tasks.append(asyncio.create_task(memory.give_back_free_memory(), name="memory"))
        tasks.append(asyncio.create_task(_tidy(store, configuration.store.keep * 3600), name="tidy"))
        await _tell_what_is_left(configuration, store)
        log.info(
            "machines: %s; server %s", ", ".join(each.key for each in configuration.machines), configuration.server.url
        )
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_EXCEPTION)  # cancelled, the tasks go on
            for task in done:
                task.result()
        finally:
            try:
                await proving_by_page.end_all(units)
            finally:
                await ended(tasks)


async def _tell_what_is_left(configuration: Configuration, store: Store) -> None:
    """Say which offsets of a touch test nobody takes back: those of machines that the configuration does not name any more."""
    named = {machine.key for machine in configuration.machines}
    for key, text in (await store.facts(offset_change.FACT)).items():
        change = offset_change.change_of(text)
        if key not in named and change.end is None:
            log.error(
                "%s: a touch test was cut off, and the configuration has no [machine.%s] any more. %s",
                key, key, change.by_hand,
            )  # fmt: skip


async def _tidy(store: Store, keep: float) -> None:
    while True:
        try:
            deleted = await store.tidy(keep)
            if deleted:
                log.info("deleted %d readings that the server has had for %g h", deleted, keep / 3600)
        except StoreError as error:
            log.warning("%s", error)
        await asyncio.sleep(TIDY_EVERY)
