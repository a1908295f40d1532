# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 topic pub`."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
import itertools
import math
import sys
import time

from ..aliases import Handle, Message
from ..cli.arguments import add_graph_arguments, positive_float, unsigned_int
from ..cli.errors import FieldValueError, NoAnswerError
from ..messages.fill import Filler
from ..messages.from_text import parse_mapping
from ..ros.graph import Graph
from ..ros.names import absolute
from ..ros.qos import add_qos_arguments, profile_of
from ..ros.session import open_session, Session
from .topic_types import message_class

_REMINDER = 1.0  # [s] between two lines that say what is waited for
_KEEP_ALIVE = 0.1  # [s]


class Pub:
    """Publish a message to a topic."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_graph_arguments(parser)
        parser.add_argument(
            'topic_name', help="Name of the ROS topic to publish to (e.g. '/chatter')"
        )
        parser.add_argument(
            'message_type', help="Type of the ROS message (e.g. 'std_msgs/msg/String')"
        )
        _add_content(parser)
        _add_repetition(parser)
        parser.add_argument(
            '--keep-alive',
            metavar='N',
            type=positive_float,
            default=_KEEP_ALIVE,
            help='Keep publishing node alive for N seconds after the last msg '
            f'(default: {_KEEP_ALIVE})',
        )
        parser.add_argument('-n', '--node-name', help='Name of the created publishing node')
        add_qos_arguments(parser, 'publish', 'default')

    def main(self, args: Namespace) -> None:
        """Publish until Ctrl-C, or as often as asked.

        Raises:
            FieldValueError: When the values do not fit the message.
            NoAnswerError: When no subscription appeared in `--max-wait-time-secs`.
        """
        message_type = message_class(args.message_type)
        message, filler = message_type(), Filler(expand_now=True)
        values = parse_mapping(sys.stdin.read() if args.stdin else args.values)
        try:
            filler.fill(message, values)
        except FieldValueError as error:
            raise FieldValueError(f'Failed to populate field: {error}') from None
        times = 1 if args.once else args.times
        with open_session(args, args.node_name) as session:
            topic = absolute(args.topic_name)
            publisher = session.node.create_publisher(message_type, topic, profile_of(args))
            wanted = (1 if times else 0) if args.wait is None else args.wait
            graph = Graph(session, args.spin_time)
            if wanted:
                _await_subscriptions(session, graph, publisher, wanted, args.max_wait_time_secs)
            else:
                graph.settle()  # who is there already hears the first message, too
            print('publisher: beginning loop')
            for count in _paced(session, times, 1.0 / args.rate):
                _stamp(filler, session)
                if args.print and count % args.print == 0:
                    print(f'publishing #{count}: {message!r}\n')
                publisher.publish(message)
            session.spin_until(lambda: False, args.keep_alive)


def _add_content(parser: ArgumentParser) -> None:
    content = parser.add_mutually_exclusive_group()
    content.add_argument(
        'values',
        nargs='?',
        default='{}',
        help='Values to fill the message with in YAML format (e.g. "data: Hello World"), '
        'otherwise the message will be published with default values',
    )
    content.add_argument('--stdin', action='store_true', help='Read values from standard input')


def _add_repetition(parser: ArgumentParser) -> None:
    parser.add_argument(
        '-r',
        '--rate',
        metavar='N',
        type=positive_float,
        default=1.0,
        help='Publishing rate in Hz (default: 1)',
    )
    parser.add_argument(
        '-p',
        '--print',
        metavar='N',
        type=int,
        default=1,
        help='Only print every N-th published message (default: 1)',
    )
    repetition = parser.add_mutually_exclusive_group()
    repetition.add_argument(
        '-1', '--once', action='store_true', help='Publish one message and exit'
    )
    repetition.add_argument(
        '-t',
        '--times',
        metavar='TIMES',
        type=unsigned_int,
        default=0,
        help='Publish this number of times and then exit',
    )
    parser.add_argument(
        '-w',
        '--wait-matching-subscriptions',
        dest='wait',
        metavar='WAIT_MATCHING_SUBSCRIPTIONS',
        type=unsigned_int,
        help='Wait until finding the specified number of matching subscriptions. Defaults to '
        '1 when using "-1"/"--once"/"--times", otherwise defaults to 0.',
    )
    parser.add_argument(
        '--max-wait-time-secs',
        metavar='MAX_WAIT_TIME_SECS',
        type=positive_float,
        help='This sets the maximum wait time in seconds if --wait-until-matching-subscriptions '
        'is set. By default, this flag is not set meaning the subscriber will wait endlessly.',
    )


def _await_subscriptions(
    session: Session, graph: Graph, publisher: Handle, wanted: int, longest: float | None
) -> None:
    """Wait for subscriptions, with a line each second that says so."""
    deadline = time.monotonic() + (math.inf if longest is None else longest)

    def enough() -> bool | None:
        session.spin_once(0.0)  # rclpy warns of subscriptions whose QoS does not fit
        return publisher.get_subscription_count() >= wanted or None

    while not enough():
        left = deadline - time.monotonic()
        if left <= 0.0:
            raise NoAnswerError(
                f'Timed out waiting for subscribers: Expected {wanted} subcribers but only got '
                f'{publisher.get_subscription_count()} subscribers'
            )
        print(f'Waiting for at least {wanted} matching subscription(s)...')
        graph.wait_until(enough, min(_REMINDER, left))


def _paced(session: Session, times: int, period: float) -> Iterator[int]:
    """Count from 1, once per period, without drift; the first at once."""
    start = time.monotonic()
    for index in range(times) if times else itertools.count():
        session.spin_until(lambda: False, start + index * period - time.monotonic())
        yield index + 1


def _stamp(filler: Filler, session: Session) -> None:
    if filler.stamps:
        now: Message = session.node.get_clock().now().to_msg()
        for set_stamp in filler.stamps:
            set_stamp(now)
