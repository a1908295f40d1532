# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Enables the drives of a bring-up as soon as they have booted."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
import contextlib
import itertools
import threading
import time
from typing import TYPE_CHECKING

from process_supervisor import CallError, GivenUpError, join_in_time

if TYPE_CHECKING:
    from .service_client import ServiceClient

ENABLE_TIMEOUT = 60.0  # longest time for all drives to boot and to be enabled in [s]
BOOT_TIMEOUT = 30.0
"""Longest time in [s] in which drives boot before they are enabled all the same."""
OPERATIONAL = 'START'
"""The NMT state of a device that has booted, on its topic ``nmt_state``."""
AGAIN = 1.0  # pause after a refusal in [s]: a drive that has not booted yet says so


def enabling_services(drives: Sequence[str], mode_service: str) -> list[list[str]]:
    """Return the services that enable drives; each group is called side by side, one by one."""
    return [[f'{drive}/{name}' for drive in drives] for name in ('init', mode_service)]


@contextlib.contextmanager
def enabling(
    drives: Sequence[str], mode_service: str, say: Callable[[str], None], namespace: str = ''
) -> Iterator[None]:
    """Enable drives beside what runs in the block.

    Args:
        drives: Their names.
        mode_service: Service of each that selects the mode of streams.
        say: Takes a line that says how it went, from any thread.
        namespace: Theirs.
    """
    ended = threading.Event()
    thread = threading.Thread(
        target=_enable,
        args=[drives, mode_service, say, ended, namespace],
        name='enabling',
        daemon=True,
    )
    thread.start()
    try:
        yield
    finally:
        ended.set()
        if late := join_in_time(thread):
            say(f'error: {late}')


def _enable(
    drives: Sequence[str],
    mode_service: str,
    say: Callable[[str], None],
    ended: threading.Event,
    namespace: str,
) -> None:
    from .service_client import ServiceClient

    client = ServiceClient('bringup', ended.is_set, namespace)
    groups = enabling_services(drives, mode_service)
    deadline = time.monotonic() + ENABLE_TIMEOUT
    try:
        client.prepare(itertools.chain(*groups))
        with contextlib.suppress(CallError):  # their services say why
            _await_boot(client, groups[0])
        while (refusal := _refusal(client, groups)) and time.monotonic() < deadline:
            client.wait_until(_after(AGAIN), 2 * AGAIN, 'another try')
        if refusal:
            say(f'error: the drives are not enabled: {refusal}')
        else:
            say(f'all {len(drives)} drives are enabled, in {mode_service}')
    except GivenUpError:
        pass  # the bring-up ends, and says why
    finally:
        client.close()


def _await_boot(client: ServiceClient, services: Sequence[str]) -> None:
    """Wait until the devices of drives are operational, of those that publish ``nmt_state``."""
    from std_msgs.msg import String

    from node_runner import LATCHED

    node, states = client.node, dict[str, str]()

    def watch(service: str) -> str:
        topic = f'{service.rpartition("/")[0]}/nmt_state'

        def note(message: String) -> None:
            states[topic] = message.data

        node.create_subscription(String, topic, note, LATCHED)
        return topic

    topics = {service: watch(service) for service in services}

    def booted() -> bool:
        return all(
            states.get(topic) == OPERATIONAL
            or (client.is_ready(service) and not node.count_publishers(topic))
            for service, topic in topics.items()
        )

    client.wait_until(booted, BOOT_TIMEOUT, 'the boot of the drives')


def _refusal(client: ServiceClient, groups: Sequence[list[str]]) -> str:
    """Call services one group after the other; return why one refused, empty when none did."""
    try:
        for services in groups:
            client.call(services, ENABLE_TIMEOUT)
    except CallError as error:
        return str(error)
    return ''


def _after(pause: float) -> Callable[[], bool]:
    end = time.monotonic() + pause
    return lambda: time.monotonic() > end
