# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Records topics: subscribes to topics as they appear, and passes bytes to a writer thread.

It takes messages from DDS as bytes, without an executor: a wait set over 100 topics costs far more
than polling each at 50 Hz, and the events executor of rclpy 7.1.6 does not support such
subscriptions. Messages that wait in DDS keep their time of arrival.
"""

from __future__ import annotations

from argparse import Namespace
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
import itertools
import threading
import time

from message_definitions import DefinitionError, message_definition
from rosbag_files import BagError, BagWriter, OfferedQos, Topic

from ..bag import Accepts
from ..cli.commands import FrontendError
from ..index import class_of, Kind
from ..names import Handle
from .bag_qos import for_recording, is_compatible, offered, overridden, RECORD_DEPTH, to_profile
from .graph import Graph

_NANO = 1_000_000_000
_TAKE_PERIOD = 0.02  # [s]
_FLUSH_PERIOD = 1.0  # [s]; what a SIGKILL may cost


class Recorder:
    """Records into a writer until stopped. A failed write raises a FrontendError."""

    def __init__(
        self,
        graph: Graph,
        writer: BagWriter,
        wanted: Accepts,
        overrides: Mapping[str, OfferedQos],
        args: Namespace,
    ) -> None:
        """Prepare without subscriptions."""
        # whether messages are dropped at the moment, because the user wants that
        self.paused = False
        self._graph = graph
        self._node = graph.session.node
        self._log = self._node.get_logger()
        self._wanted = wanted
        self._overrides = overrides
        self._args = args
        self._topics: dict[str, _Subscribed] = {}
        self._ignored: set[str] = set()
        self._queue = _WriterThread(writer, args.max_cache_size)
        self._next_look = 0.0
        self._sim_time: int | None = None  # [ns]; None before the first /clock
        self._clock = self._subscribe_clock() if args.sim_time else None

    def run(self, poll: Callable[[], None]) -> None:
        """Record until an exception, such as Ctrl-C; call `poll` between two rounds."""
        self._graph.settle(lambda: self._round(discovery=True))
        self._log.info('All requested topics are subscribed. Recording...')
        while True:
            self._round(discovery=not self._args.no_discovery)
            poll()
            time.sleep(_TAKE_PERIOD)

    def stop(self) -> None:
        """Write messages that have arrived, and report lost ones."""
        try:
            self._take()
            self._confirm()
        finally:
            self._queue.close()
        lost = {name: each.lost for name, each in self._topics.items() if each.lost}
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
        """Number of written messages by topic."""
        return self._queue.written

    def _round(self, discovery: bool) -> None:
        self._queue.check()
        now = time.monotonic()
        if now >= self._next_look:
            self._next_look = now + self._args.polling_interval / 1000.0
            if discovery:
                self._subscribe_new()
            self._confirm()
        self._take()

    def _subscribe_new(self) -> None:
        for name, types in self._graph.topics(hidden=True):
            if name in self._topics or name in self._ignored or not self._wanted(name, types[0]):
                continue
            if len(types) > 1:
                self._ignore(name, f"Topic '{name}' has more than one type: {', '.join(types)}")
            elif self._args.include_unpublished_topics or self._graph.publishers(name):
                self._subscribe(name, types[0])

    def _subscribe(self, name: str, type_: str) -> None:
        try:
            message_class = class_of(type_, Kind.MESSAGE, 'not installed')
        except FrontendError:
            self._ignore(name, f"Topic '{name}' has unknown type '{type_}'; it is not recorded")
            return
        endpoints = self._graph.publishers(name)
        profiles = tuple(offered(each.qos_profile) for each in endpoints)
        override = self._overrides.get(name)
        qos = for_recording(profiles) if override is None else overridden(override, RECORD_DEPTH)
        handle = self._node.create_subscription(
            message_class, name, _not_called, to_profile(qos), raw=True
        )
        hashes = (str(each.topic_type_hash) for each in endpoints)
        # publishers of other DDS vendors have none, which is printed as INVALID
        known = next((each for each in hashes if each.startswith('RIHS')), '')
        topic = Topic(name, type_, self._definition(type_), known, profiles)
        self._topics[name] = _Subscribed(topic, handle, qos)
        self._queue.set_topic(topic)
        self._log.info(f"Subscribed to topic '{name}'")

    def _subscribe_clock(self) -> Handle:
        from rclpy.qos import qos_profile_sensor_data
        from rosgraph_msgs.msg import Clock

        return self._node.create_subscription(
            Clock, '/clock', _not_called, qos_profile_sensor_data
        )

    def _definition(self, type_: str) -> str:
        try:
            return message_definition(type_)
        except (DefinitionError, OSError) as error:
            self._log.warning(f'{type_} is recorded without its definition: {error}')
            return ''

    def _ignore(self, name: str, reason: str) -> None:
        self._ignored.add(name)
        self._log.warning(reason)

    def _confirm(self) -> None:
        """Compare the publishers with those of the previous check."""
        for name, each in self._topics.items():
            endpoints = self._graph.publishers(name)
            each.confirm({bytes(end.endpoint_gid) for end in endpoints})
            profiles = tuple(offered(end.qos_profile) for end in endpoints)
            new = tuple(qos for qos in profiles if qos not in each.topic.qos)
            if new:
                each.topic = replace(each.topic, qos=each.topic.qos + new)
                self._queue.set_topic(each.topic)
                if not all(is_compatible(each.requested, qos) for qos in new):
                    self._log.warning(
                        f"A new publisher of '{name}' offers incompatible QoS; its messages are "
                        'not recorded. Use --qos-profile-overrides-path.'
                    )

    def _take(self) -> None:
        if self._clock is not None:
            for clock, _ in _taken(self._clock, raw=False):
                self._sim_time = clock.clock.sec * _NANO + clock.clock.nanosec
        for name, each in self._topics.items():
            count = 0
            # not more than the queue holds, so that others have their turn
            for data, info in itertools.islice(_taken(each.handle), max(each.requested.depth, 1)):
                count += 1
                self._receive(name, each, data, info)
            each.overflowed = each.overflowed or count >= each.requested.depth > 0

    def _receive(
        self, name: str, each: _Subscribed, data: bytes, info: Mapping[str, int | None]
    ) -> None:
        sequence = info['publication_sequence_number']
        each.receive(sequence)
        if self.paused:
            return
        received = info['received_timestamp'] or time.time_ns()
        log_time = received if self._clock is None else self._sim_time
        if log_time is not None:
            published = info['source_timestamp'] or received
            self._queue.write(name, data, log_time, published, sequence or 0)


@dataclass(slots=True)
class _Subscribed:
    """A recorded topic, and its number of lost messages.

    A message does not identify its publisher. So sequence numbers are compared only while the same
    single publisher is in the graph before and after.
    """

    topic: Topic
    handle: Handle
    requested: OfferedQos
    overflowed: bool = False
    lost: int = 0
    last: int | None = None
    gap: int = 0
    publishers: AbstractSet[bytes] = frozenset()

    def receive(self, sequence: int | None) -> None:
        """Process the sequence number of a message; None if the middleware has none."""
        if sequence is not None and self.last is not None:
            self.gap += max(sequence - self.last - 1, 0)
        self.last = sequence

    def confirm(self, publishers: AbstractSet[bytes]) -> None:
        """Count messages lost since the last call, given the present publishers."""
        if len(publishers) == 1 and publishers == self.publishers:
            self.lost += self.gap
        else:
            self.last = None
        self.gap, self.publishers = 0, publishers


def _taken(
    subscription: Handle, raw: bool = True
) -> Iterator[tuple[Handle, Mapping[str, int | None]]]:
    """Yield waiting messages, each with its times and sequence number."""
    handle = subscription.handle
    with handle:
        while (taken := handle.take_message(subscription.msg_type, raw)) is not None:
            yield taken


class _WriterThread:
    """Writes in its own thread, so that a stalled disk does not make DDS drop messages."""

    def __init__(self, writer: BagWriter, max_bytes: int) -> None:
        self.written: Counter[str] = Counter()  # how many messages of each topic were handed over
        # how many messages of each topic were not, as too much was waiting
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
        """Raise the exception of the thread, if any."""
        if self._error is not None:
            raise FrontendError(str(self._error))

    def close(self) -> None:
        """Write queued messages and finish the recording."""
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
    """Serve as callback of a subscription that no executor runs."""
