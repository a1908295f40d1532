# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Rejects commands that are older than a stop, and streams that a stop has ended.

A *channel* is one kind of command source, such as jogging. A *stream* is the sequence of commands
that one client sends on a channel. All times are on one steady clock in [s].
"""

from __future__ import annotations

from collections.abc import Collection, Hashable, Mapping
from dataclasses import dataclass
from itertools import count
import math
import threading
from typing import Generic, TypeVar

Channel = TypeVar('Channel', bound=Hashable)


@dataclass(frozen=True, slots=True)
class StreamRules:
    """Which commands of one client belong to one stream, and when it ends."""

    remedy: str  # how a stream that was ended is begun again
    # longest time between two commands of a stream in [s]; infinite: each single one is a stream
    together: float = math.inf
    # silence after its last command has expired with which a client has let go before a stop in
    # [s]; shorter than ``gone_after``
    let_go: float = 2.0
    # silence after a stop with which a client has let go in [s]: a process that stalls pauses, too
    gone_after: float = 10.0
    # how long a stream may have asked for the robot when that begins to follow in [s]
    begin_margin: float = 0.2


@dataclass(slots=True)
class _Stream:
    """The commands of one client on one channel."""

    last: float = -math.inf  # when its last command came in [s]
    until: float = -math.inf  # until when that counts in [s]
    asked: float = -math.inf  # since when it asks for the robot in [s]
    is_stream: bool = False
    barred: str = ''  # why it does not go on


class StreamGate(Generic[Channel]):
    """Numbers commands and stops, and rejects commands that a stop or a newer command cancels.

    A command gets its number when it is requested, and is checked by it at each later stage: a
    command from before a stop never passes afterwards. Anything that makes the robot stop
    following also ends the active streams: a pause in their commands no longer counts as a new
    request. Thread-safe.
    """

    def __init__(
        self, channels: Collection[Channel], rules: Mapping[Channel, StreamRules]
    ) -> None:
        """Begin open; ``rules`` apply to the channels on which clients send streams."""
        self._lock = threading.Lock()  # held for a few instructions only
        self._numbers = count(1)
        self._floors: dict[Channel, tuple[int, str]] = dict.fromkeys(channels, (0, ''))
        self._rules = rules
        self._streams: dict[tuple[Channel, Hashable], _Stream] = {}

    def number(self) -> int:
        """Return the number for a command that is requested now."""
        with self._lock:
            return next(self._numbers)

    def stop(self, channels: Collection[Channel], reason: str, number: int | None = None) -> None:
        """Reject all commands so far on some channels, or those before a given number."""
        with self._lock:
            number = next(self._numbers) if number is None else number
            for channel in channels:
                if self._floors[channel][0] < number:
                    self._floors[channel] = number, reason

    def refusal(self, channel: Channel, number: int) -> str:
        """Return why a command is rejected; empty while it may proceed."""
        floor, reason = self._floors[channel]
        return f'stopped before it had begun: {reason}' if number < floor else ''

    def command(
        self, channel: Channel, client: Hashable, now: float, expires: float = -math.inf
    ) -> str:
        """Record a command of motion of a client, which moves the robot until it expires.

        Returns:
            Why it is rejected, because its stream was ended; empty if it is accepted.
        """
        rules = self._rules[channel]
        with self._lock:
            stream = self._streams.setdefault((channel, client), _Stream())
            if now - stream.last > rules.gone_after:
                stream.is_stream, stream.barred = False, ''
            stream.is_stream |= now - stream.last <= rules.together
            if math.isinf(rules.together) and now - stream.until > rules.let_go:
                stream.asked = now
            stream.last, stream.until = now, max(now, expires)
            return f'{stream.barred}; {rules.remedy}' if stream.barred else ''

    def release(self, channel: Channel, client: Hashable) -> None:
        """Record that a client released: its next command is a new request."""
        with self._lock:
            self._streams.pop((channel, client), None)

    def ask(self, channel: Channel, client: Hashable, now: float) -> None:
        """Record that a command requests the robot; minus infinity withdraws the request."""
        with self._lock:
            if (channel, client) in self._streams:
                self._streams[channel, client].asked = now

    def interrupt(self, reason: str, now: float) -> None:
        """Stop all channels; active streams must be released before they continue."""
        self.stop(self._floors.keys(), reason)
        with self._lock:
            for (channel, _), stream in self._streams.items():
                self._bar(stream, self._rules[channel], reason, now)

    def begin(self, reason: str, now: float) -> None:
        """Stop the streams that did not request the robot recently, when it begins to follow."""
        barred: set[Channel] = set()
        with self._lock:
            for (channel, _), stream in self._streams.items():
                rules = self._rules[channel]
                has_asked = now - stream.asked <= rules.begin_margin
                if not math.isinf(rules.together):  # it asks once
                    stream.asked = -math.inf
                if not has_asked and self._bar(stream, rules, reason, now):
                    barred.add(channel)
        self.stop(barred, reason)

    def renew(self, channel: Channel, now: float, silence: float = -math.inf) -> None:
        """Treat the next commands on a channel as new requests, on behalf of a person.

        Streams whose last command is no older than ``silence`` in [s] stay as they are.
        """
        with self._lock:
            self._streams = {
                key: stream
                for key, stream in self._streams.items()
                if key[0] != channel or now - stream.last <= silence
            }

    def _bar(self, stream: _Stream, rules: StreamRules, reason: str, now: float) -> bool:
        """Require the release of a stream if it is active; return whether it is."""
        is_under_way = stream.is_stream and now - stream.until <= rules.let_go
        if is_under_way:
            stream.barred = stream.barred or reason
        return is_under_way
