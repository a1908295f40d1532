# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Plays a recording: publishes its bytes unchanged, at their times of arrival."""

from __future__ import annotations

from argparse import ArgumentTypeError, Namespace
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
import contextlib
from dataclasses import dataclass
import threading
import time

from rosbag_files import BagMessage, OfferedQos, Topic

from ..bag import bag_errors, CHOICE, load_overrides, open_bag, STORAGE, topic_filter
from ..cli.commands import argument, flag, FrontendError, positive_float, unsigned_float, verb
from ..cli.interrupts import has_keyboard, keys
from ..index import class_of, Kind
from ..names import absolute, Handle
from ..ros.bag_qos import for_playing, overridden, PLAY_DEPTH, to_profile
from ..ros.graph import Graph, open_session, Session

_RIGHT = '\x1b[C'  # the key as a terminal sends it
_NANO = 1_000_000_000
ACK_TIMEOUT = 5.0  # [s] for all subscriptions that are slow to acknowledge the last messages


def _remap(text: str) -> tuple[str, str]:
    old, separator, new = text.partition(':=')
    if not (old and separator and new):
        raise ArgumentTypeError(f'{text!r} is not OLD:=NEW')
    return absolute(old), absolute(new)


_COURSE = (
    argument(
        '-m',
        '--remap',
        default=[],
        nargs='+',
        type=_remap,
        metavar='OLD:=NEW',
        help='Topics to publish under other names.',
    ),
    argument(
        '-r', '--rate', type=positive_float, default=1.0, help='Rate at which to play (default: 1)'
    ),
    flag('-l', '--loop', help='Start again at the end, until Ctrl-C.'),
    argument('-d', '--delay', type=unsigned_float, default=0.0, help='Time [s] before each play.'),
    argument(
        '--start-offset',
        type=unsigned_float,
        default=0.0,
        help='Moment [s] of the bag to start from.',
    ),
    argument('--playback-duration', type=float, default=-1.0, help='Time [s] of the bag to play.'),
    argument(
        '--clock',
        type=positive_float,
        nargs='?',
        const=40.0,
        metavar='HZ',
        help='Publish the time of the bag to /clock at this rate (40 Hz).',
    ),
    flag('-p', '--start-paused', help='Start in a paused state; SPACE resumes.'),
    flag('--disable-keyboard-controls', help='Leave the keyboard alone.'),
)


@verb(
    argument('bag_path', help='Bag to open'),
    STORAGE,
    *CHOICE,
    *_COURSE,
)
def play(args: Namespace) -> None:
    """Publish the messages of a recording."""
    reader = open_bag(args.bag_path)
    accepts = topic_filter(args, not (args.topics or args.regex), hidden=True)
    recorded = reader.metadata
    chosen = [
        each.topic
        for each in recorded.topics
        if each.count and accepts(each.topic.name, each.topic.type)
    ]
    if not chosen:
        raise FrontendError(f"'{args.bag_path}' has no messages of the chosen topics")
    start = recorded.start + round(args.start_offset * _NANO)
    duration = args.playback_duration
    end = start + round(duration * _NANO) if duration >= 0.0 else None
    clock = PlayClock(args.rate, args.start_paused)
    overrides = load_overrides(args.qos_profile_overrides_path)
    with open_session(args, 'rosbag2_player') as session, contextlib.ExitStack() as stack:
        player = Player(session, chosen, clock, overrides, dict(args.remap))
        typed = stack.enter_context(keys(not args.disable_keyboard_controls))
        report = session.node.get_logger().info
        topics = f"{len(chosen)} of {len(recorded.topics)} topics of '{args.bag_path}'"
        report(f'Playing {topics}, {recorded.duration / _NANO:.1f} s')
        report(f'Set rate to {args.rate:g}')
        if has_keyboard() and not args.disable_keyboard_controls:
            report('Press SPACE for Pause/Resume')
            report('Press CURSOR_RIGHT for Play Next Message')
        report(f'Playback until timestamp: {-1 if end is None else end}')
        Graph(session).settle()  # who is there already receives the first message, too
        if args.clock:
            clock.step(start)
            stack.enter_context(_publishing_clock(session, clock, args.clock))
        names, steps = {topic.name for topic in chosen}, 0

        def poll() -> int:
            """SPACE pauses and resumes; return 1 for each right arrow, which plays a message."""
            nonlocal steps
            if text := typed():
                steps += text.count(_RIGHT) if clock.paused else 0
                if text.count(' ') % 2:
                    clock.toggle()
                    steps = 0
                    report('Pausing play.' if clock.paused else 'Resuming play.')
            step, steps = min(steps, 1), max(steps - 1, 0)
            return step

        with contextlib.suppress(KeyboardInterrupt), bag_errors():
            while True:
                time.sleep(args.delay)
                count = player.play(reader.messages(names, start), start, end, poll)
                if not args.loop or not count:
                    break
            player.finish()


@contextlib.contextmanager
def _publishing_clock(session: Session, clock: PlayClock, rate: float) -> Iterator[None]:
    """Publish /clock from a thread: the player sleeps between two messages."""
    from rclpy.time import Time
    from rosgraph_msgs.msg import Clock

    publisher = session.node.create_publisher(Clock, '/clock', 10)
    end = threading.Event()

    def run() -> None:
        while not end.wait(1.0 / rate):
            publisher.publish(Clock(clock=Time(nanoseconds=clock.moment()).to_msg()))

    thread = threading.Thread(target=run, name='bag_clock', daemon=True)
    thread.start()
    try:
        yield
    finally:
        end.set()
        thread.join()


_POLL = 0.02  # [s] between two looks at the keyboard


@dataclass(slots=True)
class PlayClock:
    """Clock of a playback, with pause."""

    rate: float  # how many times faster than it was recorded
    paused: bool = False  # whether it stands still
    _moment: float = 0.0  # [ns] of the recording
    _since: float | None = None  # None before the start, and while it stands still

    def start(self, moment: int) -> None:
        """Start at a time of the recording in [ns]."""
        self._moment = float(moment)
        self._since = None if self.paused else time.monotonic()

    def moment(self) -> int:
        """Current time of the recording in [ns]."""
        elapsed = 0.0 if self._since is None else time.monotonic() - self._since
        return int(self._moment + elapsed * self.rate * _NANO)

    def wait_for(self, moment: int) -> float:
        """Return the wait in [s] until a time of the recording; a short one while paused."""
        return _POLL if self.paused else (moment - self.moment()) / (self.rate * _NANO)

    def step(self, moment: int) -> None:
        """Advance to a time in [ns] while paused."""
        self._moment = float(moment)

    def toggle(self) -> None:
        """Pause or resume."""
        moment = self.moment()
        self.paused = not self.paused
        self.start(moment)


class Player:
    """Publishes messages of a recording."""

    def __init__(
        self,
        session: Session,
        topics: Sequence[Topic],
        clock: PlayClock,
        overrides: Mapping[str, OfferedQos],
        remaps: Mapping[str, str],
    ) -> None:
        """Create the publishers; QoS overrides and new names are keyed by recorded topic."""
        self.clock = clock  # which moment is due
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

    def finish(self) -> None:
        """Wait until subscriptions have the last messages; the publishers' end would lose them."""
        from rclpy.duration import Duration  # rclpy is imported by the session

        deadline = time.monotonic() + ACK_TIMEOUT
        for publisher in self._publishers.values():
            left = max(deadline - time.monotonic(), 0.0)
            publisher.wait_for_all_acked(Duration(seconds=left))

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
