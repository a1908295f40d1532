# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 topic hz`, `bw` and `delay`."""

from __future__ import annotations

from argparse import Namespace
from collections import deque
from collections.abc import Callable, Collection
import math
import time

from ..cli.commands import Argument, argument, flag, FrontendError, positive_int
from ..names import absolute, Message
from ..ros.graph import Graph, graph_verb
from ..ros.qos import matching_profile, SUBSCRIPTION_QOS
from .topic import class_of_topic
from .topic_echo import compile_filter

NANOSECONDS = 1_000_000_000  # in a second
_KILO = 1000

_REPORT_PERIOD = 1.0  # [s]
_LONG_WINDOW = 10_000
_SHORT_WINDOW = 100


def spread(values: Collection[int]) -> str:
    """Return the second line of `topic hz` and `topic delay` for values in [ns]."""
    count, least, most = len(values), min(values) / NANOSECONDS, max(values) / NANOSECONDS
    mean = sum(values) / count
    deviation = math.sqrt(sum((value - mean) ** 2 for value in values) / count) / NANOSECONDS
    return f'\tmin: {least:.3f}s max: {most:.3f}s std dev: {deviation:.5f}s window: {count}'


class Periods:
    """The periods between the last messages, at most `window` of them."""

    def __init__(self, window: int) -> None:
        self._periods: deque[int] = deque(maxlen=window)
        self._last: int | None = None
        self._reported: int | None = None

    def add(self, now: int) -> str | None:
        """Add a message at a time in [ns]; once a second, return the text to print."""
        last, self._last = self._last, now
        if last is None:
            return None
        if now < last:
            self._periods.clear()
            self._reported = None
            return 'time has reset, resetting counters'
        self._periods.append(now - last)
        if self._reported is None:
            self._reported = now
        if now < self._reported + NANOSECONDS:
            return None
        self._reported = now
        total = sum(self._periods)
        rate = NANOSECONDS * len(self._periods) / total if total else 0.0
        return f'average rate: {rate:.3f}\n{spread(self._periods)}'


def delay_text(delays: deque[int], news: list[int]) -> str | None:
    """Move `news` in [ns] to `delays`; return the text of `topic delay`, None without any."""
    if not news:
        return 'no new messages' if delays else None
    delays.extend(news)
    news.clear()
    mean = sum(delays) / len(delays) / NANOSECONDS
    return f'average delay: {mean:.3f}\n{spread(delays)}'


def bandwidth(samples: Collection[tuple[float, int]], now: float) -> str | None:
    """Return the text of `topic bw` for samples of ([s], [byte]); None for less than two."""
    if len(samples) < 2:
        return None
    times, sizes = zip(*samples, strict=True)
    if now <= times[0]:
        return None
    rate = sum(sizes) / (now - times[0])
    unit, scale = 'MB', _KILO**2
    if rate < _KILO**2:
        unit, scale = ('B', 1) if rate < _KILO else ('KB', _KILO)
    digits = 0 if scale == 1 else 2
    texts = [
        f'{value / scale:.{digits}f} {unit}'
        for value in (rate, sum(sizes) / len(sizes), min(sizes), max(sizes))
    ]
    return (
        f'{texts[0]}/s from {len(sizes)} messages\n'
        f'\tMessage size mean: {texts[1]} min: {texts[2]} max: {texts[3]}'
    )


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
