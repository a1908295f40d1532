# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One bring-up per bus, port and ROS domain: a second one would only disturb the first."""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import fcntl
import os
from pathlib import Path
import re

from .exceptions import StartError


@contextlib.contextmanager
def exclusive(thing: str, folder: Path, remedy: str) -> Iterator[None]:
    """Hold a lock on something, as long as the block runs.

    The kernel gives the lock back when this process ends, however it ends.

    Args:
        thing: What is used, as the user knows it: ``bus vcan0``.
        folder: Folder for the lock file.
        remedy: What to take instead, for the message: ``another bus with --can``.

    Raises:
        StartError: Another process holds it; the message says which.
    """
    file = folder / f'bringup-{os.getuid()}-{re.sub("[^A-Za-z0-9.]+", "-", thing)}.lock'
    # not truncated yet: it has the pid of the process that holds the lock
    descriptor = os.open(file, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_NOFOLLOW, 0o600)
    with os.fdopen(descriptor, 'r+', encoding='ascii') as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            lock.seek(0)
            raise StartError(
                f'another bring-up (process {lock.read().strip()}) is on {thing}; stop it, '
                f'or take {remedy}'
            ) from error
        lock.truncate(0)
        lock.write(f'{os.getpid()}\n')
        lock.flush()
        yield
