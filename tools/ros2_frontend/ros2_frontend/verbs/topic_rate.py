# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 topic hz`, `bw` and `delay`."""

from __future__ import annotations

from argparse import Namespace
from collections import deque
from collections.abc import Callable
import time

from ..aliases import Message
from ..cli.arguments import positive_int
from ..cli.errors import FrontendError
from ..cli.verb import Argument, argument, flag
from ..names import absolute
from ..ros.graph import Graph, graph_verb
from ..ros.qos import matching_profile, SUBSCRIPTION_QOS
from .expression import compile_filter
from .statistics import bandwidth, delay_text, NANOSECONDS, Periods
from .topic_types import class_of_topic

_REPORT_PERIOD = 1.0  # [s]
_LONG_WINDOW = 10_000
_SHORT_WINDOW = 100


def _arguments(topic_help: str, window: int) -> tuple[Argument, ...]:
    return (
        argument('topic_name', help=topic_help),
        argument(
            '--window',
            '-w',
            metavar='WINDOW',
            type=positive_int,
            default=window,
            help=f'window size, in # of messages, for calculating rate (default: {window})',
        ),
        SUBSCRIPTION_QOS,
    )


def _subscribe(graph: Graph, args: Namespace, take: Callable[[Message], None], raw: bool) -> None:
    topic = absolute(args.topic_name)
    message_type = class_of_topic(args.topic_name, graph, forever=True)
    graph.wait_for(lambda: graph.publishers(topic) or None)
    profile = matching_profile(args, graph, topic, print)
    graph.session.node.create_subscription(message_type, topic, take, profile, raw=raw)


def _report(graph: Graph, report: Callable[[], str | None]) -> None:
    """Print a report each second until Ctrl-C."""
    due = time.monotonic()
    while True:
        due += _REPORT_PERIOD
        graph.session.spin_until(lambda: False, due - time.monotonic())
        if text := report():
            print(text)


@graph_verb(
    *_arguments("Name of the ROS topic to listen to (e.g. '/chatter')", _LONG_WINDOW),
    argument(
        '--filter',
        dest='filter_expr',
        metavar='EXPR',
        help='only measure messages matching the specified Python expression',
    ),
    flag(
        '--wall-time',
        dest='use_wtime',
        help='calculates rate using wall time which can be helpful when clock is not '
        'published during simulation',
    ),
)
def hz(graph: Graph, args: Namespace) -> None:
    """Print the rate once a second until Ctrl-C."""
    periods = Periods(args.window)
    accepts = compile_filter(args.filter_expr)
    clock = graph.session.node.get_clock()

    def take(message: Message) -> None:
        now = time.time_ns() if args.use_wtime else clock.now().nanoseconds
        if now and accepts(message) and (text := periods.add(now)):
            print(text)

    _subscribe(graph, args, take, raw=not args.filter_expr)
    graph.session.spin()


@graph_verb(*_arguments('Topic name to monitor for bandwidth utilization', _SHORT_WINDOW))
def bw(graph: Graph, args: Namespace) -> None:
    """Print the bandwidth once a second until Ctrl-C."""
    samples: deque[tuple[float, int]] = deque(maxlen=args.window)
    _subscribe(graph, args, lambda data: samples.append((time.monotonic(), len(data))), raw=True)
    print(f'Subscribed to [{args.topic_name}]')
    _report(graph, lambda: bandwidth(samples, time.monotonic()))


@graph_verb(*_arguments('Topic name to calculate the delay for', _LONG_WINDOW))
def delay(graph: Graph, args: Namespace) -> None:
    """Print the delay once a second until Ctrl-C."""
    delays: deque[int] = deque(maxlen=args.window)
    news: list[int] = []
    clock = graph.session.node.get_clock()

    def take(message: Message) -> None:
        if not hasattr(message, 'header'):
            raise FrontendError('msg does not have header')
        stamp = message.header.stamp
        if now := clock.now().nanoseconds:
            news.append(now - (stamp.sec * NANOSECONDS + stamp.nanosec))

    _subscribe(graph, args, take, raw=False)
    _report(graph, lambda: delay_text(delays, news))
