# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Clients that hold a jog let go of it before it moves an arm that had stopped following."""

from __future__ import annotations

from collections.abc import Hashable
import threading

from ..exceptions import NotReadyError

GONE_AFTER = 10.0
"""Silence in [s] after which a client holds nothing; a network that is cut makes silence, too."""

BEGIN_MARGIN = 0.2
"""How long before the arm begins to follow a jog may have begun, in [s]: getting drives back takes
some cycles."""

BEGINS = 'the arm has just begun to follow'


class HoldToRun:
    """Who holds a jog, and who has to let go first; for any thread.

    A client holds from its first command of motion to its next command of zero. Whatever stops the
    arm from following ends what is held: somebody halted a drive, took it, or it has faulted. A
    pause of the commands is no new request, as a stalled process makes one, too.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()  # held for a few instructions only
        self._held: dict[Hashable, tuple[float, float]] = {}  # first and last command in [s]
        self._barred: dict[Hashable, str] = {}

    def command(self, client: Hashable, now: float, *, is_zero: bool) -> None:
        """Record a command.

        Args:
            is_zero: Whether it commands standing still.

        Raises:
            NotReadyError: The client has to let go first.
        """
        with self._lock:
            if is_zero:
                self._held.pop(client, None)
                self._barred.pop(client, None)
                return
            since, last = self._held.get(client, (now, now))
            self._held[client] = now if now - last > GONE_AFTER else since, now
            reason = self._barred.get(client)
        if reason is not None:
            raise NotReadyError(
                f'{reason}; a jog that was held before moves nothing: release and jog again (send'
                ' a zero between, or call ~/start_servo)'
            )

    def interrupt(self, reason: str, now: float) -> None:
        """Require active clients to release before they jog again."""
        with self._lock:
            for client, (_, last) in self._held.items():
                if now - last <= GONE_AFTER:
                    self._barred.setdefault(client, reason)

    def begin(self, now: float) -> bool:
        """The arm begins to follow: require clients that have held for longer to release first.

        Returns:
            Whether somebody has to let go.
        """
        with self._lock:
            for client, (since, last) in self._held.items():
                if now - since > BEGIN_MARGIN and now - last <= GONE_AFTER:
                    self._barred.setdefault(client, BEGINS)
            return bool(self._barred)

    def renew(self) -> None:
        """Treat the next command as a new jog: a person has requested it."""
        with self._lock:
            self._held.clear()
            self._barred.clear()
