# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The graph: topics without a publisher or subscription, and pairs whose QoS does not fit."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
import re

from ..aliases import Endpoint, Handle
from ..ros.graph import Graph
from .findings import error, Finding, Report, warning

_ALWAYS_THERE = ('/parameter_events', '/rosout')
_LEADING_WORD = re.compile(r'^(?:warning|error): ', re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic with its endpoints.

    Attributes:
        name: Its absolute name.
        types: The types that it is used with.
        publishers: An `rclpy.topic_endpoint_info.TopicEndpointInfo` for each.
        subscriptions: The same for each subscription.
    """

    name: str
    types: tuple[str, ...]
    publishers: tuple[Endpoint, ...]
    subscriptions: tuple[Endpoint, ...]


def read_topics(graph: Graph) -> list[Topic]:
    """All topics but the two that every node has.

    Args:
        graph: The graph.

    Returns:
        The topics, sorted by name.
    """
    return [
        Topic(name, tuple(types), tuple(graph.publishers(name)), tuple(graph.subscriptions(name)))
        for name, types in graph.topics()
        if name not in _ALWAYS_THERE
    ]


def check_topics(topics: list[Topic]) -> Iterator[Finding]:
    """Check that every topic has publishers, subscriptions and one type.

    Args:
        topics: The topics.

    Yields:
        What is wrong.
    """
    for topic in topics:
        if len(topic.types) > 1:
            yield error(f'{topic.name} has several types: {", ".join(topic.types)}.')
        if topic.publishers and not topic.subscriptions:
            yield warning(f'Publisher without subscriber detected on {topic.name}.')
        if topic.subscriptions and not topic.publishers:
            yield warning(f'Subscriber without publisher detected on {topic.name}.')


def check_qos(topics: list[Topic]) -> Iterator[Finding]:
    """Check that the QoS of every publisher and subscription fit together.

    Args:
        topics: The topics.

    Yields:
        What is wrong.
    """
    from rclpy.qos import QoSCompatibility

    for topic, publisher, subscription, verdict, reason in _pairs(topics):
        pair = f'{publisher.node_name} -> {subscription.node_name}'
        text = f"found on topic '{topic.name}' ({pair}): {_LEADING_WORD.sub('', reason)}"
        if verdict == QoSCompatibility.ERROR:
            yield error(f'QoS compatibility error {text}')
        elif verdict == QoSCompatibility.WARNING:
            yield warning(f'QoS compatibility warning {text}')


def _pairs(topics: list[Topic]) -> Iterator[tuple[Topic, Endpoint, Endpoint, Handle, str]]:
    from rclpy.qos import qos_check_compatible

    for topic in topics:
        for publisher in topic.publishers:
            for subscription in topic.subscriptions:
                verdict, reason = qos_check_compatible(
                    publisher.qos_profile, subscription.qos_profile
                )
                yield topic, publisher, subscription, verdict, reason


def report_topics(topics: list[Topic]) -> Report:
    """The topics and how many publish and subscribe them.

    Args:
        topics: The topics.

    Returns:
        Three rows for each.
    """
    rows: list[tuple[str, object]] = []
    for topic in topics:
        rows.append(('topic', topic.name))
        rows.append(('publisher count', len(topic.publishers)))
        rows.append(('subscriber count', len(topic.subscriptions)))
    return Report('TOPIC LIST', tuple(rows) or (('topic', 'none'),))


def report_qos(topics: list[Topic]) -> Report:
    """The pairs of publisher and subscription and whether they fit together.

    Args:
        topics: The topics.

    Returns:
        Four rows for each pair.
    """
    rows: list[tuple[str, object]] = []
    for topic, publisher, subscription, _, reason in _pairs(topics):
        rows.append(('topic [type]', f'{topic.name} [{publisher.topic_type}]'))
        rows.append(('publisher node', publisher.node_name))
        rows.append(('subscriber node', subscription.node_name))
        rows.append(('compatibility status', reason or 'OK'))
    nothing = (('compatibility status', 'No publisher/subscriber pairs found'),)
    return Report('QOS COMPATIBILITY LIST', tuple(rows) or nothing)
