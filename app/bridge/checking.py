"""The check of a configuration against the server and the controls: what it writes is there already, or goes again."""

import asyncio
import contextlib
import logging
import os
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from app.bridge.configuration import Configuration, Machine
from app.bridge.kinds.mtconnect import AgentError, Context
from app.bridge.links import Link, LinkError, Position, carries_decisions, look_who_answers, silence
from app.bridge.moments import wrong_date
from app.bridge.program import link_of
from app.bridge.server_side import TRUST
from app.bridge.store_lock import StoreError, alone_with, lock_of
from inband_client import AsyncClient, Forbidden, NotFound, ProblemError, Unauthorized, Unavailable, Untrusted

log = logging.getLogger(__name__)


class Finding(NamedTuple):
    """One line: about what, what was found, and whether it is good."""

    about: str
    words: str
    good: bool

    def __str__(self) -> str:
        """Mark, subject, sentence."""
        return f"{'✓' if self.good else '✗'} {self.about}: {self.words}"


async def check(configuration: Configuration) -> list[Finding]:
    """The server's answer to each key, and each control's; machines are asked at the same time."""
    with _as_the_only_one(configuration) as alone:
        found = await asyncio.gather(
            *(_of_machine(configuration, machine, alone=alone) for machine in configuration.machines)
        )
    warned = [Finding("configuration", words, False) for words in configuration.warnings]
    return [*warned, _store(configuration)] + [finding for findings in found for finding in findings]


@contextlib.contextmanager
def _as_the_only_one(configuration: Configuration) -> Iterator[bool]:
    """Keep a bridge from starting meanwhile; false where one runs already."""
    file = Path(configuration.store.file)
    with contextlib.ExitStack() as stack:
        try:
            if lock_of(file).exists():  # made by the bridge, with its rights: by nobody else
                stack.enter_context(alone_with(file))
        except StoreError:
            yield False
        else:
            yield True


def _store(configuration: Configuration) -> Finding:
    file = Path(configuration.store.file)
    places = [file, file.parent] if file.exists() else [next(each for each in file.parents if each.exists())]
    if refused := [str(each) for each in places if not os.access(each, os.W_OK)]:
        words = f"this user may not write {refused[0]}; the bridge keeps readings there: give it the right, or name another file"
        return Finding(f"store {file}", words, False)
    return Finding(f"store {file}", "this user may write it; the bridge has to run as the same", True)


async def _of_machine(configuration: Configuration, machine: Machine, *, alone: bool) -> list[Finding]:
    parts = {
        "server": _server(configuration, machine),
        "control": _control(machine, alone=alone),
        "agent": _context(machine),
    }
    return [finding for name, part in parts.items() for finding in await _all_of(part, machine, name)]


async def _all_of(findings: AsyncIterator[Finding], machine: Machine, name: str) -> list[Finding]:
    """The findings of one part of a check; an error that nobody thought of ends that part alone."""
    found = []
    try:
        async for finding in findings:
            found.append(finding)  # noqa: PERF401 - those before an error count
    except Exception as error:
        log.debug("%s: %s", machine.key, name, exc_info=error)
        words = f"the check of the {name} ended with an error that it does not know: {type(error).__name__}: {error}"
        found.append(Finding(machine.key, words, False))
    return found


async def _server(configuration: Configuration, machine: Machine) -> AsyncIterator[Finding]:
    url = configuration.server.url
    async with AsyncClient(url, machine.secret, verify=configuration.server.ca or True, patience=0.0) as client:
        try:
            await client.get(f"/machines/{machine.key}")
            yield Finding(machine.key, f"the server {url} knows the machine and its key", True)
            for number, key in machine.characteristics.items():
                try:
                    found = await client.get(f"/characteristics/{key}")
                except Forbidden:  # the key is right: the machine was found with it
                    yield Finding(machine.key, f"characteristic {number} = {key!r} belongs to another machine", False)
                    continue
                except NotFound:
                    yield Finding(machine.key, f"characteristic {number} = {key!r} does not exist at the server", False)
                    continue
                if found["machine"] != machine.key:  # the key is a person's or a program's
                    words = f"characteristic {number} = {key!r} belongs to {found['machine']}"
                    yield Finding(machine.key, words, False)
                elif machine.corrections != "none" and found["parameters"]["tool_memory"] not in {
                    location.tool_memory for location in machine.location
                }:
                    memory = found["parameters"]["tool_memory"]
                    yield Finding(
                        machine.key, f"{key} corrects tool memory {memory}, which has no location here", False
                    )
        except (Unauthorized, Forbidden) as error:
            yield Finding(machine.key, f"the server refuses the key: {error.detail} Make a new one in Set-up.", False)
        except Untrusted as error:
            yield Finding(machine.key, f"{error.detail} {TRUST}", False)
        except Unavailable as error:
            words = f"the server {url} does not answer ({error.detail}) Does it run, and is the address right, http or https too?"
            yield Finding(machine.key, words, False)
        except ProblemError as error:
            yield Finding(machine.key, f"the server {url}: {error}", False)


async def _control(machine: Machine, *, alone: bool) -> AsyncIterator[Finding]:
    link, once = link_of(machine), getattr(machine.settings, "read_once", False)
    if once and not alone:
        words = "a bridge runs with this store and reads here, so nothing was opened: its log says what comes"
        yield Finding(machine.key, words, True)
        return
    try:
        async with asyncio.timeout(machine.patience):
            identity = await link.connect()
        look_who_answers(identity, machine.identity)
        named = "" if machine.identity else f"; put identity = {identity!r} into the configuration"
        yield Finding(machine.key, f"the control answers as {identity!r}{named}", True)
        if not carries_decisions(link):
            yield Finding(
                machine.key,
                "this machine cannot be stopped by Inband: a decision to stop is an alarm, and nothing more",
                True,
            )
        if by_date := wrong_date(link.clock):
            yield Finding(machine.key, by_date, False)
        async with asyncio.timeout(machine.patience):
            received = await link.fetch(Position())
            lost = ", and are gone: the check stores nothing. Have them printed again" if once and received else ""
            yield Finding(machine.key, f"{len(received)} readings can be fetched now{lost}", not lost)
            if not by_date and (by_readings := wrong_date(link.clock)):
                yield Finding(machine.key, by_readings, False)
            if faults := [each.fault for each in received if each.fault]:
                words = f"{len(faults)} of them would go to the quarantine, the first because: {faults[0]}"
                yield Finding(machine.key, words, False)
            if remark := getattr(link, "remark", ""):
                yield Finding(machine.key, remark, False)
        async with asyncio.timeout(machine.patience):
            for memory, offset in (await link.offsets()).items():
                yield Finding(machine.key, f"tool memory {memory} holds {offset:.4f} mm", True)
        async for finding in _tried(machine, link, alone=alone):
            yield finding
    except TimeoutError:
        yield Finding(machine.key, silence(machine.patience), False)
    except LinkError as error:
        yield Finding(machine.key, str(error), False)
    finally:
        await link.close()


async def _tried(machine: Machine, link: Link, *, alone: bool) -> AsyncIterator[Finding]:
    """The result of doing what the bridge will do, where a kind can do it without a change."""
    try_out: Callable[[], Awaitable[list[str]]] | None = getattr(link, "try_out", None)
    if try_out is None:
        return
    if not alone:
        yield Finding(machine.key, "a bridge runs with this store, so nothing was tried out that writes", True)
        return
    async with asyncio.timeout(machine.patience):
        wrong = await try_out()
    for words in wrong:
        yield Finding(machine.key, words, False)
    if not wrong:
        yield Finding(machine.key, "what the bridge will write there can be written", True)


async def _context(machine: Machine) -> AsyncIterator[Finding]:
    if machine.context is None:
        return
    context = Context(machine.key, machine.context)
    try:
        async with context.client() as http:
            await context.poll(http)
        without, silent = context.lacking()
        words = [context.summary()]
        if without:
            words.append(
                f"No data item of the device tells {' and '.join(without)}; any other is named as context.{without[0]}."
            )
        if silent:
            words.append(f"UNAVAILABLE now: {', '.join(silent)}.")
        yield Finding(machine.key, " ".join(words), good=not context.unclear and "part" not in without)
    except AgentError as error:
        yield Finding(machine.key, str(error), False)
