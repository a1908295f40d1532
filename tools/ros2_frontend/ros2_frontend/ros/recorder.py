# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Records topics: subscribes to what appears, and hands bytes to a thread that writes.

Messages are taken from DDS as bytes, without an executor: a wait set over a hundred topics costs
far more than asking each of them fifty times a second, and the events executor of rclpy 7.1.6
does not serve such subscriptions. What waits in DDS has the time at which it arrived.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
import threading
import time

from ..aliases import Handle
from ..bag.files import BagError, BagWriter, OfferedQos, Topic
from ..bag.losses import LossCounter
from ..bag.selection import TopicFilter
from ..cli.errors import FrontendError
from ..index.definition import concatenated
from ..index.interfaces import class_of, definition_path, Kind
from .bag_qos import for_recording, is_compatible, offered, overridden, RECORD_DEPTH, to_profile
from .graph import Graph

_TAKE_PERIOD = 0.02  # [s]
_FLUSH_PERIOD = 1.0  # [s]; what a SIGKILL may cost


@dataclass(frozen=True, slots=True)
class RecordOptions:
    """What to record.

    Attributes:
        wanted: Which topics.
        unpublished: Whether to subscribe to topics that nobody publishes.
        leaves: Whether to subscribe to topics to which nobody else subscribes.
        discovery: Whether to record topics that appear later.
        polling: Time between two looks at the graph [s].
        max_cache: Bytes that may wait to be written; messages beyond are dropped, and counted.
        overrides: QoS to subscribe with, by topic.
        sim_time: Whether to stamp with /clock, and to record nothing before it.
    """

    wanted: TopicFilter
    unpublished: bool = False
    leaves: bool = True
    discovery: bool = True
    polling: float = 0.1
    max_cache: int = 100 * 1024 * 1024
    overrides: Mapping[str, OfferedQos] = field(default_factory=dict)
    sim_time: bool = False


class Recorder:
    """Records into a writer until it is stopped.

    Attributes:
        paused: Whether messages are dropped at the moment, because the user wants that.
    """

    def __init__(self, graph: Graph, writer: BagWriter, options: RecordOptions) -> None:
        """Subscribe to nothing yet.

        Args:
            graph: The graph; its node subscribes.
            writer: Where messages go.
            options: What to record.
        """
        self.paused = False
        self._graph = graph
        self._node = graph.session.node
        self._log = self._node.get_logger()
        self._options = options
        self._topics: dict[str, _Subscribed] = {}
        self._ignored: set[str] = set()
        self._queue = _WriterThread(writer, options.max_cache)
        self._next_look = 0.0
        self._clock = _SimClock(self._node) if options.sim_time else None

    def run(self, poll: Callable[[], None]) -> None:
        """Record until an exception, which is how Ctrl-C arrives.

        Args:
            poll: Called between two rounds.

        Raises:
            FrontendError: The recording cannot be written.
        """
        # a participant that is slow to be discovered is asked to announce itself meanwhile
        self._graph.wait_for(self._settle)
        self._log.info('All requested topics are subscribed. Recording...')
        while True:
            self._round(self._options.discovery)
            poll()
            time.sleep(_TAKE_PERIOD)

    def stop(self) -> None:
        """Write what has arrived, and report what was lost.

        Raises:
            FrontendError: The recording cannot be written.
        """
        try:
            self._take()
            self._confirm()
        finally:
            self._queue.close()
        lost = {
            name: each.counter.lost for name, each in self._topics.items() if each.counter.lost
        }
        for title, counts in (
            ('never arrived at the recorder', lost),
            ('dropped, because the disk is too slow (--max-cache-size)', self._queue.dropped),
        ):
            if counts:
                listed = ', '.join(f'{name}: {count}' for name, count in sorted(counts.items()))
                self._log.warning(f'{sum(counts.values())} messages {title}: {listed}')
        unsure = sorted(name for name, each in self._topics.items() if each.overflowed)
        if unsure:
            self._log.warning(f'Perhaps more messages were lost of {", ".join(unsure)}')

    @property
    def counts(self) -> Mapping[str, int]:
        """How many messages of each topic were written."""
        return self._queue.written

    def _settle(self) -> None:
        self._round(discovery=True)

    def _round(self, discovery: bool) -> None:
        self._queue.check()
        now = time.monotonic()
        if now >= self._next_look:
            self._next_look = now + self._options.polling
            if discovery:
                self._subscribe_new()
            self._confirm()
        self._take()

    def _subscribe_new(self) -> None:
        for name, types in self._graph.topics(hidden=True):
            if name in self._topics or name in self._ignored:
                continue
            if not self._options.wanted.accepts(name, types[0]):
                continue
            if len(types) > 1:
                self._ignore(name, f"Topic '{name}' has more than one type: {', '.join(types)}")
            elif self._is_due(name):
                self._subscribe(name, types[0])

    def _is_due(self, name: str) -> bool:
        options = self._options
        if not options.unpublished and not self._graph.publishers(name):
            return False
        return options.leaves or bool(self._graph.subscriptions(name))

    def _subscribe(self, name: str, type_: str) -> None:
        try:
            message_class = class_of(type_, Kind.MESSAGE, 'not installed')
        except FrontendError:
            self._ignore(name, f"Topic '{name}' has unknown type '{type_}'; it is not recorded")
            return
        endpoints = self._graph.publishers(name)
        profiles = tuple(offered(each.qos_profile) for each in endpoints)
        override = self._options.overrides.get(name)
        qos = for_recording(profiles) if override is None else overridden(override, RECORD_DEPTH)
        handle = self._node.create_subscription(
            message_class, name, _not_called, to_profile(qos), raw=True
        )
        hashes = [str(each.topic_type_hash) for each in endpoints]
        topic = Topic(name, type_, self._definition(type_), hashes[0] if hashes else '', profiles)
        self._topics[name] = _Subscribed(topic, handle, message_class, qos)
        self._queue.set_topic(topic)
        self._log.info(f"Subscribed to topic '{name}'")

    def _definition(self, type_: str) -> str:
        try:
            return concatenated(type_, lambda name: definition_path(name).read_text('utf-8'))
        except (FrontendError, OSError) as error:
            self._log.warning(f'{type_} is recorded without its definition: {error}')
            return ''

    def _ignore(self, name: str, reason: str) -> None:
        self._ignored.add(name)
        self._log.warning(reason)

    def _confirm(self) -> None:
        """Compare the publishers with those of the last look."""
        for name, each in self._topics.items():
            endpoints = self._graph.publishers(name)
            found = each.counter.confirm({bytes(end.endpoint_gid) for end in endpoints})
            if found:
                self._log.warning(f"{found} messages of '{name}' were lost")
            profiles = tuple(offered(end.qos_profile) for end in endpoints)
            new = tuple(qos for qos in profiles if qos not in each.topic.qos)
            if new:
                each.add_profiles(new)
                self._queue.set_topic(each.topic)
                if not all(is_compatible(each.requested, qos) for qos in new):
                    self._log.warning(
                        f"A new publisher of '{name}' offers incompatible QoS; its messages are "
                        'not recorded. Use --qos-profile-overrides-path.'
                    )

    def _take(self) -> None:
        if self._clock is not None:
            self._clock.take()
        for name, each in self._topics.items():
            count = 0
            for data, info in each.take():
                count += 1
                self._receive(name, each, data, info)
            each.overflowed = each.overflowed or count >= each.requested.depth > 0

    def _receive(
        self, name: str, each: _Subscribed, data: bytes, info: Mapping[str, int | None]
    ) -> None:
        sequence = info['publication_sequence_number']
        each.counter.receive(sequence)
        if self.paused:
            return
        received = info['received_timestamp'] or time.time_ns()
        log_time = received if self._clock is None else self._clock.now
        if log_time is not None:
            published = info['source_timestamp'] or received
            self._queue.write(name, data, log_time, published, sequence or 0)


@dataclass(slots=True)
class _Subscribed:
    """A topic that is recorded."""

    topic: Topic
    subscription: Handle
    message_class: Handle
    requested: OfferedQos
    counter: LossCounter = field(default_factory=LossCounter)
    overflowed: bool = False

    def take(self) -> Iterator[tuple[bytes, Mapping[str, int | None]]]:
        """Yield what waits; not more than the queue holds, so that others have their turn."""
        handle = self.subscription.handle
        with handle:
            for _ in range(max(self.requested.depth, 1)):
                taken = handle.take_message(self.message_class, True)
                if taken is None:
                    return
                yield taken

    def add_profiles(self, profiles: tuple[OfferedQos, ...]) -> None:
        """Note what more publishers offer."""
        topic = self.topic
        self.topic = Topic(
            topic.name, topic.type, topic.definition, topic.type_hash, topic.qos + profiles
        )


class _SimClock:
    """The time of /clock.

    Attributes:
        now: In [ns]; None before the first message.
    """

    def __init__(self, node: Handle) -> None:
        from rclpy.qos import qos_profile_sensor_data
        from rosgraph_msgs.msg import Clock

        self.now: int | None = None
        self._class = Clock
        self._subscription = node.create_subscription(
            Clock, '/clock', _not_called, qos_profile_sensor_data
        )

    def take(self) -> None:
        """Read what has arrived."""
        handle = self._subscription.handle
        with handle:
            while (taken := handle.take_message(self._class, False)) is not None:
                clock = taken[0].clock
                self.now = clock.sec * 1_000_000_000 + clock.nanosec


class _WriterThread:
    """Writes on a thread of its own: a disk that stalls must not make DDS drop messages.

    Attributes:
        written: How many messages of each topic were handed over.
        dropped: How many messages of each topic were not, as too much was waiting.
    """

    def __init__(self, writer: BagWriter, max_bytes: int) -> None:
        self.written: Counter[str] = Counter()
        self.dropped: Counter[str] = Counter()
        self._writer = writer
        self._max_bytes = max_bytes
        self._waiting = 0  # [byte]; each side adds to its own of two numbers
        self._done = 0
        self._jobs: deque[tuple[Callable[..., None], tuple[object, ...], int]] = deque()
        self._closing = threading.Event()
        self._error: BagError | None = None
        self._thread = threading.Thread(target=self._run, name='bag_writer', daemon=True)
        self._thread.start()

    def set_topic(self, topic: Topic) -> None:
        self._jobs.append((self._writer.set_topic, (topic,), 0))

    def write(
        self, name: str, data: bytes, log_time: int, publish_time: int, sequence: int
    ) -> None:
        size = len(data)
        if self._max_bytes and self._waiting - self._done + size > self._max_bytes:
            self.dropped[name] += 1
            return
        self._waiting += size
        self.written[name] += 1
        job = (name, data, log_time, publish_time, sequence)
        self._jobs.append((self._writer.write, job, size))

    def check(self) -> None:
        """Raise what the thread met.

        Raises:
            FrontendError: The recording cannot be written.
        """
        if self._error is not None:
            raise FrontendError(str(self._error))

    def close(self) -> None:
        """Write what waits and finish the recording.

        Raises:
            FrontendError: The recording cannot be written.
        """
        self._closing.set()
        self._thread.join()
        self.check()

    def _run(self) -> None:
        try:
            flushed = time.monotonic()
            while not self._closing.wait(_TAKE_PERIOD):
                self._work()
                if time.monotonic() - flushed >= _FLUSH_PERIOD:
                    self._writer.flush()
                    flushed = time.monotonic()
            self._work()
            self._writer.close()
        except BagError as error:
            self._error = error
        except Exception as error:  # noqa: BLE001  # or the recording would end without a word
            self._error = BagError(f'internal error: {error!r}')

    def _work(self) -> None:
        while self._jobs:
            do, arguments, size = self._jobs.popleft()
            do(*arguments)
            self._done += size


def _not_called(_: object) -> None:
    """Stand for the callback of a subscription that no executor serves."""
