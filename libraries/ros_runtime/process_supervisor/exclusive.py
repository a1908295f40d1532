# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One bring-up per bus, serial port and ROS namespace: a second one would only disturb the first.

Held by a socket in the abstract namespace of Unix: it is seen by all users of the network
namespace, as the bus and the domain are, and the kernel gives it back when its process ends,
however it ends.
"""

from __future__ import annotations

from collections.abc import Iterator
import contextlib
import errno
import hashlib
import socket
import struct

from .exceptions import StartError

_CREDENTIALS = struct.Struct('3i')  # struct ucred: process, user, group
_LONGEST = 100  # [byte] of the 107 that an abstract name may have


@contextlib.contextmanager
def exclusive(thing: str, remedy: str) -> Iterator[None]:
    """Hold something, as long as the block runs.

    Args:
        thing: What is used, as the user knows it: ``bus vcan0``.
        remedy: What to take instead, for the message: ``another bus with --can``.

    Raises:
        StartError: Another process holds it; the message names it.
    """
    name = _abstract_name(thing)
    with socket.socket(socket.AF_UNIX) as holder:
        try:
            holder.bind(name)
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise
            raise StartError(
                f'another bring-up{_process_of(name)} is on {thing}; stop it, or take {remedy}'
            ) from error
        holder.listen()
        yield


def _abstract_name(thing: str) -> bytes:
    name = f'\0bringup {thing}'.encode()
    if len(name) <= _LONGEST:
        return name
    digest = hashlib.blake2b(name, digest_size=16).hexdigest().encode()
    return name[: _LONGEST - len(digest)] + digest


def _process_of(name: bytes) -> str:
    """Return whose socket it is; nothing when it has just been closed."""
    with socket.socket(socket.AF_UNIX) as probe:
        probe.setblocking(False)
        try:
            probe.connect(name)
            raw = probe.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
        except OSError:
            return ''
    process, user, _ = _CREDENTIALS.unpack(raw)
    return f' (process {process} of user {user})'
