# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 bag play`."""

from __future__ import annotations

from argparse import ArgumentTypeError, Namespace
from collections.abc import Callable, Iterator
import contextlib
from dataclasses import dataclass
import math
import threading
import time

from ..aliases import Handle
from ..bag.files import bag_errors, BagReader, load_overrides, open_bag
from ..bag.selection import topic_filter
from ..cli.arguments import positive_float, unsigned_int
from ..cli.errors import FrontendError
from ..cli.keyboard import has_keyboard, keys
from ..cli.verb import argument, flag, verb
from ..ros.graph import Graph
from ..ros.names import absolute
from ..ros.player import PlayClock, Player
from ..ros.session import open_session, Session

_NANO = 1_000_000_000
_RIGHT = '\x1b[C'  # the key as a terminal sends it


def _seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 <= value < math.inf:
        raise ArgumentTypeError(f'{text!r} is no number of seconds')
    return value


def _remap(text: str) -> tuple[str, str]:
    old, separator, new = text.partition(':=')
    if not (old and separator and new):
        raise ArgumentTypeError(f'{text!r} is not OLD:=NEW')
    return absolute(old), absolute(new)


_CHOICE = (
    argument('--topics', default=[], nargs='+', metavar='Topic', help='Topics to replay.'),
    argument('-e', '--regex', default='', help='Play topics with this regular expression.'),
    argument(
        '-x', '--exclude-regex', default='', help='Leave out topics with this regular expression.'
    ),
    argument(
        '--exclude-topics', default=[], nargs='+', metavar='Topic', help='Topics to leave out.'
    ),
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
        '--qos-profile-overrides-path',
        metavar='FILE',
        help='YAML file with QoS profiles for specific topics.',
    ),
)
_COURSE = (
    argument(
        '-r', '--rate', type=positive_float, default=1.0, help='Rate at which to play (default: 1)'
    ),
    flag('-l', '--loop', help='Start again at the end, until Ctrl-C.'),
    argument('-d', '--delay', type=_seconds, default=0.0, help='Time [s] before each play.'),
    argument(
        '--start-offset', type=_seconds, default=0.0, help='Moment [s] of the bag to start from.'
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
    argument(
        '--wait-for-all-acked',
        type=unsigned_int,
        metavar='MS',
        help='Longest time [ms] to wait at the end until all subscriptions have everything; 0 for '
        'no limit.',
    ),
    argument('--read-ahead-queue-size', type=unsigned_int, help='Accepted and without effect.'),
)


@verb(
    argument('bag_path', help='Bag to open'),
    argument('-s', '--storage', choices=['mcap'], help='Storage identifier: mcap'),
    *_CHOICE,
    *_COURSE,
)
def play(args: Namespace) -> None:
    """Publish what was recorded.

    Raises:
        FrontendError: When there is no recording, or nothing in it is chosen.
    """
    reader = open_bag(args.bag_path)
    wanted = topic_filter(args, not (args.topics or args.regex), hidden=True)
    chosen = [
        each.topic
        for each in reader.metadata.topics
        if each.count and wanted.accepts(each.topic.name, each.topic.type)
    ]
    if not chosen:
        raise FrontendError(f"'{args.bag_path}' has no messages of the chosen topics")
    names = {topic.name for topic in chosen}
    clock = PlayClock(args.rate, args.start_paused)
    overrides = load_overrides(args.qos_profile_overrides_path)
    with open_session(args, 'rosbag2_player') as session, contextlib.ExitStack() as stack:
        player = Player(session, chosen, clock, overrides, dict(args.remap))
        typed = stack.enter_context(keys(not args.disable_keyboard_controls))
        keyboard = _Keyboard(clock, typed, session.node.get_logger())
        for line in _introduction(args, reader, len(chosen)):
            keyboard.log.info(line)
        Graph(session).settle()  # who is there already receives the first message, too
        if args.clock:
            clock.step(reader.metadata.start + round(args.start_offset * _NANO))
            stack.enter_context(_publishing_clock(session, clock, args.clock))
        with contextlib.suppress(KeyboardInterrupt), bag_errors():
            _play_rounds(player, reader, names, args, keyboard.poll)


def _introduction(args: Namespace, reader: BagReader, chosen: int) -> Iterator[str]:
    """Yield what is played and by which keys it is controlled, in the words of rosbag2."""
    recorded = reader.metadata
    topics = f"{chosen} of {len(recorded.topics)} topics of '{args.bag_path}'"
    yield f'Playing {topics}, {recorded.duration / _NANO:.1f} s'
    yield f'Set rate to {args.rate:g}'
    if has_keyboard() and not args.disable_keyboard_controls:
        yield 'Press SPACE for Pause/Resume'
        yield 'Press CURSOR_RIGHT for Play Next Message'
    end = _end(args, recorded.start + round(args.start_offset * _NANO))
    yield f'Playback until timestamp: {-1 if end is None else end}'


def _end(args: Namespace, start: int) -> int | None:
    """Return the time at which a play that begins at a time ends in [ns]; None for no end."""
    duration = args.playback_duration
    return start + round(duration * _NANO) if duration >= 0.0 else None


def _play_rounds(
    player: Player, reader: BagReader, names: set[str], args: Namespace, poll: Callable[[], int]
) -> None:
    start = reader.metadata.start + round(args.start_offset * _NANO)
    end = _end(args, start)
    while True:
        time.sleep(args.delay)
        count = player.play(reader.messages(names, start), start, end, poll)
        if not args.loop or not count:
            break
    if args.wait_for_all_acked is not None:
        player.wait_for_acknowledgements(args.wait_for_all_acked / 1000.0)


@dataclass(slots=True)
class _Keyboard:
    """SPACE pauses and resumes, the right arrow plays the next message."""

    clock: PlayClock
    typed: Callable[[], str]
    log: Handle
    steps: int = 0

    def poll(self) -> int:
        """Return 1 for each message that is played by a key."""
        text = self.typed()
        if text:
            self.steps += text.count(_RIGHT) if self.clock.paused else 0
            if text.count(' ') % 2:
                self.clock.toggle()
                self.steps = 0
                self.log.info('Pausing play.' if self.clock.paused else 'Resuming play.')
        if not self.steps:
            return 0
        self.steps -= 1
        return 1


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
