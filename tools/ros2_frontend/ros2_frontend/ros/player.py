# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Plays a recording: its bytes are published as they are, at the times at which they arrived."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
import time

from rosbag_files import BagMessage, OfferedQos, Topic

from ..cli.errors import FrontendError
from ..index import class_of, Kind
from ..names import Handle
from .bag_qos import for_playing, overridden, PLAY_DEPTH, to_profile
from .session import Session

_POLL = 0.02  # [s] between two looks at the keyboard
_NANO = 1_000_000_000


@dataclass(slots=True)
class PlayClock:
    """Which moment of a recording is due.

    Attributes:
        rate: How many times faster than it was recorded.
        paused: Whether it stands still.
    """

    rate: float
    paused: bool = False
    _moment: float = 0.0  # [ns] of the recording
    _since: float | None = None  # None before the start, and while it stands still

    def start(self, moment: int) -> None:
        """Begin at a moment of the recording in [ns]."""
        self._moment = float(moment)
        self._since = None if self.paused else time.monotonic()

    def moment(self) -> int:
        """The moment in [ns]."""
        elapsed = 0.0 if self._since is None else time.monotonic() - self._since
        return int(self._moment + elapsed * self.rate * _NANO)

    def wait_for(self, moment: int) -> float:
        """Time until a moment in [s]; a while where it stands still."""
        return _POLL if self.paused else (moment - self.moment()) / (self.rate * _NANO)

    def step(self, moment: int) -> None:
        """Go to a moment in [ns] while it stands still."""
        self._moment = float(moment)

    def toggle(self) -> None:
        """Stand still, or go on."""
        moment = self.moment()
        self.paused = not self.paused
        self.start(moment)


class Player:
    """Publishes messages of a recording.

    Attributes:
        clock: Which moment is due.
    """

    def __init__(
        self,
        session: Session,
        topics: Sequence[Topic],
        clock: PlayClock,
        overrides: Mapping[str, OfferedQos],
        remaps: Mapping[str, str],
    ) -> None:
        """Make the publishers of topics, with QoS and names by recorded topic where given."""
        self.clock = clock
        self._node = session.node
        self._publishers: dict[str, Handle] = {}
        for topic in topics:
            publisher = self._publisher(topic, overrides, remaps.get(topic.name, topic.name))
            if publisher is not None:
                self._publishers[topic.name] = publisher

    def play(
        self,
        messages: Iterable[BagMessage],
        start: int,
        end: int | None,
        poll: Callable[[], int],
    ) -> int:
        """Publish messages at their times from `start` to `end` in [ns]; return how many.

        `poll` is called at least every 20 ms; it returns 1 to play the next message out of turn.
        """
        self.clock.start(start)
        count = 0
        for message in messages:
            if end is not None and message.log_time > end:
                break
            self._await(message.log_time, poll)
            publisher = self._publishers.get(message.topic)
            if publisher is not None:
                publisher.publish(message.data)
                count += 1
        return count

    def _await(self, moment: int, poll: Callable[[], int]) -> None:
        while True:
            if poll():
                self.clock.step(moment)
                return
            left = self.clock.wait_for(moment)
            if left <= 0.0:
                return
            time.sleep(min(left, _POLL))

    def _publisher(
        self, topic: Topic, overrides: Mapping[str, OfferedQos], name: str
    ) -> Handle | None:
        if topic.serialization != 'cdr':
            self._node.get_logger().warning(
                f"Topic '{topic.name}' is '{topic.serialization}', not CDR; not played"
            )
            return None
        try:
            message_class = class_of(topic.type, Kind.MESSAGE, 'not installed')
        except FrontendError:
            self._node.get_logger().warning(
                f"Topic '{topic.name}' has unknown type '{topic.type}'; not played"
            )
            return None
        override = overrides.get(topic.name)
        qos = for_playing(topic.qos) if override is None else overridden(override, PLAY_DEPTH)
        return self._node.create_publisher(message_class, name, to_profile(qos))
