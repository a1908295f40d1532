# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 topic hz`, `bw` and `delay`."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Callable
import time

from ..aliases import Message
from ..cli.arguments import add_graph_arguments, positive_int
from ..cli.errors import FrontendError
from ..ros.graph import Graph
from ..ros.names import absolute
from ..ros.qos import add_qos_arguments, matching_profile
from ..ros.session import open_session, Session
from .expression import compile_filter
from .statistics import Delays, NANOSECONDS, Periods, Sizes
from .topic_types import await_class_of_topic

_REPORT_PERIOD = 1.0  # [s]
_LONG_WINDOW = 10_000
_SHORT_WINDOW = 100


def _add_common(parser: ArgumentParser, help_: str, window: int) -> None:
    add_graph_arguments(parser)
    parser.add_argument('topic_name', help=help_)
    parser.add_argument(
        '--window',
        '-w',
        metavar='WINDOW',
        type=positive_int,
        default=window,
        help=f'window size, in # of messages, for calculating rate (default: {window})',
    )
    add_qos_arguments(parser, 'subscribe', 'sensor_data')


def _subscribe(
    session: Session, args: Namespace, take: Callable[[Message], None], raw: bool
) -> None:
    graph = Graph(session, args.spin_time)
    topic = absolute(args.topic_name)
    message_type = await_class_of_topic(args.topic_name, graph)
    graph.wait_for(lambda: graph.publishers(topic) or None)
    profile = matching_profile(args, graph, topic, print)
    session.node.create_subscription(message_type, topic, take, profile, raw=raw)


class Hz:
    """Print the average receiving rate to screen."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        _add_common(parser, "Name of the ROS topic to listen to (e.g. '/chatter')", _LONG_WINDOW)
        parser.add_argument(
            '--filter',
            dest='filter_expr',
            metavar='EXPR',
            help='only measure messages matching the specified Python expression',
        )
        parser.add_argument(
            '--wall-time',
            dest='use_wtime',
            action='store_true',
            help='calculates rate using wall time which can be helpful when clock is not '
            'published during simulation',
        )

    def main(self, args: Namespace) -> None:
        """Print the rate once a second until Ctrl-C."""
        periods = Periods(args.window)
        accepts = compile_filter(args.filter_expr)
        with open_session(args) as session:
            clock = session.node.get_clock()

            def take(message: Message) -> None:
                now = time.time_ns() if args.use_wtime else clock.now().nanoseconds
                if now and accepts(message) and not periods.add(now):
                    print('time has reset, resetting counters')
                report = periods.report()
                if report:
                    print(report)

            _subscribe(session, args, take, raw=not args.filter_expr)
            session.spin()


class Bw:
    """Display bandwidth used by topic."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        _add_common(parser, 'Topic name to monitor for bandwidth utilization', _SHORT_WINDOW)

    def main(self, args: Namespace) -> None:
        """Print the bandwidth once a second until Ctrl-C."""
        sizes = Sizes(args.window)
        with open_session(args) as session:

            def take(message: bytes) -> None:
                sizes.add(time.monotonic(), len(message))

            _subscribe(session, args, take, raw=True)
            print(f'Subscribed to [{args.topic_name}]')
            _report(session, lambda: sizes.report(time.monotonic()))


class Delay:
    """Display delay of topic from timestamp in header."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        _add_common(parser, 'Topic name to calculate the delay for', _LONG_WINDOW)

    def main(self, args: Namespace) -> None:
        """Print the delay once a second until Ctrl-C.

        Raises:
            FrontendError: When the messages have no header.
        """
        delays = Delays(args.window)
        with open_session(args) as session:
            clock = session.node.get_clock()

            def take(message: Message) -> None:
                if not hasattr(message, 'header'):
                    raise FrontendError('msg does not have header')
                stamp = message.header.stamp
                now = clock.now().nanoseconds
                if now:
                    delays.add(now - (stamp.sec * NANOSECONDS + stamp.nanosec))

            _subscribe(session, args, take, raw=False)
            _report(session, delays.report)


def _report(session: Session, report: Callable[[], str | None]) -> None:
    """Print a report each second until Ctrl-C."""
    due = time.monotonic()
    while True:
        due += _REPORT_PERIOD
        session.spin_until(lambda: False, due - time.monotonic())
        text = report()
        if text:
            print(text)
