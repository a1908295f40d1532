# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Clients that hold a jog let go of it before it moves an arm that had stopped following."""

from __future__ import annotations

from collections.abc import Hashable
import threading

from ..exceptions import NotReadyError

GONE_AFTER = 10.0
"""Silence in [s] after which a client that had to let go has done so."""

LET_GO_MARGIN = 2.0
"""Silence in [s] after its last command has expired, with which a client has let go before the arm
stops: that command moves nothing any more, and a stall is rarely so long."""

BEGIN_MARGIN = 0.2
"""How long before the arm begins to follow a jog may have begun, in [s]: getting drives back takes
some cycles."""

BEGINS = 'the arm has just begun to follow'


class HoldToRun:
    """Who holds a jog, and who has to let go first; for any thread.

    A client holds from its first command of motion to its next command of zero, or to a silence of
    :data:`LET_GO_MARGIN`. Whatever stops the arm from following ends what is held: somebody halted
    a drive, took it, or it has faulted. From then on a pause of the commands is no new request, as
    a stalled process makes one, too, unless it is longer than :data:`GONE_AFTER`.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()  # held for a few instructions only
        # first command, and when the last one came and expires, in [s]
        self._held: dict[Hashable, tuple[float, float, float]] = {}
        self._barred: dict[Hashable, str] = {}

    def command(
        self, client: Hashable, now: float, *, is_zero: bool, expires: float = 0.0
    ) -> None:
        """Record a command.

        Args:
            is_zero: Whether it commands standing still.
            expires: Steady time until which it moves the arm in [s]; by default not beyond now.

        Raises:
            NotReadyError: The client has to let go first.
        """
        with self._lock:
            if is_zero:
                self._held.pop(client, None)
                self._barred.pop(client, None)
                return
            since, last, until = self._held.get(client, (now, now, now))
            if now - last > GONE_AFTER:
                self._barred.pop(client, None)
            if now - until > LET_GO_MARGIN:
                since = now
            self._held[client] = since, now, max(now, expires)
            reason = self._barred.get(client)
        if reason is not None:
            raise NotReadyError(
                f'{reason}; a jog that was held before moves nothing: release and jog again, with'
                f' a command of zero between (silence counts after {GONE_AFTER:g} s only), or call'
                ' ~/start_servo'
            )

    def interrupt(self, reason: str, now: float) -> None:
        """Require active clients to release before they jog again."""
        with self._lock:
            for client, (_, _, until) in self._held.items():
                if now - until <= LET_GO_MARGIN:
                    self._barred.setdefault(client, reason)

    def begin(self, now: float) -> bool:
        """The arm begins to follow: require clients that have held for longer to release first.

        Returns:
            Whether somebody has to let go.
        """
        with self._lock:
            for client, (since, _, until) in self._held.items():
                if now - since > BEGIN_MARGIN and now - until <= LET_GO_MARGIN:
                    self._barred.setdefault(client, BEGINS)
            return bool(self._barred)

    def renew(self) -> None:
        """Treat the next command as a new jog: a person has requested it."""
        with self._lock:
            self._held.clear()
            self._barred.clear()
