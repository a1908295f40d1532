# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 topic pub`."""

from __future__ import annotations

from argparse import Namespace
import itertools
import math
import sys
import time

from ..cli.commands import (
    argument,
    content,
    exclusive,
    flag,
    GRAPH_ARGUMENTS,
    NoAnswerError,
    positive_float,
    unsigned_int,
    verb,
)
from ..messages.fill import filled, Filler
from ..names import absolute, Handle
from ..ros.graph import Graph, open_session
from ..ros.qos import profile_of, PUBLISHER_QOS
from .topic import message_class, TOPICS

_REMINDER = 1.0  # [s] between two lines about what is waited for
_KEEP_ALIVE = 0.1  # [s]


_REPETITION = (
    argument(
        '-r',
        '--rate',
        metavar='N',
        type=positive_float,
        default=1.0,
        help='Publishing rate in Hz (default: 1)',
    ),
    argument(
        '-p',
        '--print',
        metavar='N',
        type=int,
        default=1,
        help='Only print every N-th published message (default: 1)',
    ),
    exclusive(
        flag('-1', '--once', help='Publish one message and exit'),
        argument(
            '-t',
            '--times',
            metavar='TIMES',
            type=unsigned_int,
            default=0,
            help='Publish this number of times and then exit',
        ),
    ),
    argument(
        '-w',
        '--wait-matching-subscriptions',
        dest='wait',
        metavar='WAIT_MATCHING_SUBSCRIPTIONS',
        type=unsigned_int,
        help='Wait until finding the specified number of matching subscriptions. Defaults to '
        '1 when using "-1"/"--once"/"--times", otherwise defaults to 0.',
    ),
    argument(
        '--max-wait-time-secs',
        metavar='MAX_WAIT_TIME_SECS',
        type=positive_float,
        help='This sets the maximum wait time in seconds if --wait-until-matching-subscriptions '
        'is set. By default, this flag is not set meaning the subscriber will wait endlessly.',
    ),
)


@verb(
    *GRAPH_ARGUMENTS,
    TOPICS.name_argument('publish to', '/chatter'),
    argument('message_type', help="Type of the ROS message (e.g. 'std_msgs/msg/String')"),
    content(
        'values',
        'Values to fill the message with in YAML format (e.g. "data: Hello World"), '
        'otherwise the message will be published with default values',
        'Read values from standard input',
    ),
    *_REPETITION,
    argument(
        '--keep-alive',
        metavar='N',
        type=positive_float,
        default=_KEEP_ALIVE,
        help='Keep publishing node alive for N seconds after the last msg '
        f'(default: {_KEEP_ALIVE})',
    ),
    argument('-n', '--node-name', help='Name of the created publishing node'),
    PUBLISHER_QOS,
)
def pub(args: Namespace) -> None:
    """Publish until Ctrl-C, or a given number of times."""
    message_type = message_class(args.message_type)
    filler = Filler(expand_now=True)
    text = sys.stdin.read() if args.stdin else args.values
    message = filled(message_type(), text, filler)
    times = 1 if args.once else args.times
    with open_session(args, args.node_name) as session:
        topic = absolute(args.topic_name)
        publisher = session.node.create_publisher(message_type, topic, profile_of(args))
        wanted = (1 if times else 0) if args.wait is None else args.wait
        graph = Graph(session, args.spin_time)
        if wanted:
            _await_subscriptions(graph, publisher, wanted, args.max_wait_time_secs)
        else:
            graph.settle()  # who is there already receives the first message, too
        print('publisher: beginning loop')
        start = time.monotonic()
        for index in range(times) if times else itertools.count():
            session.spin_until(lambda: False, start + index / args.rate - time.monotonic())
            for set_stamp in filler.stamps:
                set_stamp(session.node.get_clock().now().to_msg())
            if args.print and (index + 1) % args.print == 0:
                print(f'publishing #{index + 1}: {message!r}\n')
            publisher.publish(message)
        session.spin_until(lambda: False, args.keep_alive)


def _await_subscriptions(
    graph: Graph, publisher: Handle, wanted: int, longest: float | None
) -> None:
    """Wait for subscriptions, at most `longest` in [s]; print a line each second."""
    deadline = time.monotonic() + (math.inf if longest is None else longest)

    def enough() -> bool | None:
        graph.session.spin_once(0.0)  # rclpy warns of subscriptions whose QoS does not fit
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
