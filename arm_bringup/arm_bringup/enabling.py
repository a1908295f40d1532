# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Enables the drives of a bring-up as soon as they have booted."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
import contextlib
import threading
import time

from process_supervisor import CallError, GivenUpError

from .demos.wave.play import Client

PATIENCE = 60.0
"""Longest time for all drives to boot and to be enabled in [s]."""
AGAIN = 1.0
"""Pause after a refusal in [s]: a drive that has not booted yet says so."""


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
        target=_enable, args=[drives, mode_service, say, ended, namespace], name='enabling'
    )
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def _enable(
    drives: Sequence[str],
    mode_service: str,
    say: Callable[[str], None],
    ended: threading.Event,
    namespace: str,
) -> None:
    from .demos.client import ArmClient

    client = ArmClient(ended.is_set, namespace)
    init, mode = ([f'{drive}/{name}' for drive in drives] for name in ('init', mode_service))
    deadline = time.monotonic() + PATIENCE
    try:
        client.prepare([*init, *mode])
        while (refusal := _refusal(client, [init, mode])) and time.monotonic() < deadline:
            client.wait_until(_after(AGAIN), 2 * AGAIN, 'another try')
        if refusal:
            say(f'error: the drives are not enabled: {refusal}')
        else:
            say(f'all {len(drives)} drives are enabled, in {mode_service}')
    except GivenUpError:
        pass  # the bring-up ends, and says why
    finally:
        client.close()


def _refusal(client: Client, calls: Sequence[list[str]]) -> str:
    """Call services one group after the other; return why one refused, empty when none did."""
    try:
        for services in calls:
            client.call(services, PATIENCE)
    except CallError as error:
        return str(error)
    return ''


def _after(pause: float) -> Callable[[], bool]:
    end = time.monotonic() + pause
    return lambda: time.monotonic() > end
