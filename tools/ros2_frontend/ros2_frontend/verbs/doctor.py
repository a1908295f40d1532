# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 doctor` (`ros2 wtf`): environment, topics without a partner, QoS that does not fit."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator, Mapping
import os
from pathlib import Path
import platform
import re
import sys

from ..cli.commands import flag
from ..names import Handle
from ..ros.graph import Graph, graph_verb

Finding = tuple[bool, str]
"""Whether it is an error or a warning; the possible problem and its remedy."""
Rows = list[tuple[str, object]]

_ALWAYS_THERE = ('/parameter_events', '/rosout')
_LEADING_WORD = re.compile(r'^(?:warning|error): ', re.IGNORECASE)
# https://docs.ros.org/en/jazzy/Concepts/Intermediate/About-Domain-ID.html: above 101 the ports
# meet the ephemeral ones of Linux, above 232 they do not exist
_SAFE_DOMAIN = 101
_LAST_DOMAIN = 232
_RANGES = ('LOCALHOST', 'OFF', 'SUBNET', 'SYSTEM_DEFAULT')
_SHOWN = re.compile(r'ROS_(?!VERSION|PYTHON)|DDS_NETWORK|RMW_|FAST(?:RT|D)DS|AMENT_PREFIX_PATH')


@graph_verb(
    flag('--report', '-r', help='Print all reports.'),
    flag(
        '--include-warnings',
        '-iw',
        help='Include warnings as failed checks. Warnings are ignored by default.',
    ),
    flag(
        '--exclude-packages',
        '-ep',
        help='Accepted and without effect: package versions are not checked',
    ),
)
def doctor(graph: Graph, args: Namespace) -> None:
    """Print what may be wrong, or all tables; exit code 0, as ros2cli."""
    graph.settle()
    if args.report:
        for title, rows in _reports(graph):
            width = max(len(name) for name, _ in rows)
            print(f'\n   {title}', *(f'{name:{width}}: {value}' for name, value in rows), sep='\n')
        return
    results = {
        'environment': list(check_environment(os.environ)),
        'topic': list(_check_topics(graph)),
        'middleware': list(_check_qos(graph)),
    }
    for name, findings in results.items():
        for is_error, text in findings:
            kind = 'UserWarning: ERROR' if is_error else 'UserWarning'
            print(f'\n{name}: {kind}: {text}', file=sys.stderr)
    failed = [
        name
        for name, findings in results.items()
        if any(is_error or args.include_warnings for is_error, _ in findings)
    ]
    if failed:
        print(f'\n{len(failed)}/{len(results)} check(s) failed\n')
        print('Failed modules:', *failed)
    else:
        print(f'\nAll {len(results)} checks passed\n')


def check_environment(environ: Mapping[str, str]) -> Iterator[Finding]:
    """Check the environment variables that affect discovery."""
    if (distro := environ.get('ROS_DISTRO', '')) != 'jazzy':
        yield False, f"ROS_DISTRO is '{distro}', not jazzy; source env.sh in this shell."
    domain = environ.get('ROS_DOMAIN_ID', '') or '0'
    if not domain.isdecimal() or int(domain) > _LAST_DOMAIN:
        yield True, f"ROS_DOMAIN_ID is '{domain}'; it takes 0 to {_LAST_DOMAIN}."
    elif int(domain) > _SAFE_DOMAIN:
        text = 'uses ports that Linux gives to other programs'
        yield False, f'ROS_DOMAIN_ID {domain} {text}; 0 to {_SAFE_DOMAIN} is safe.'
    reach = environ.get('ROS_AUTOMATIC_DISCOVERY_RANGE', '')
    if reach and reach.upper() not in _RANGES:
        yield True, f"ROS_AUTOMATIC_DISCOVERY_RANGE is '{reach}'; it takes {', '.join(_RANGES)}."
    for prefix in environ.get('AMENT_PREFIX_PATH', '').split(':'):
        if not Path(prefix, 'share', 'ament_index').is_dir():
            text = 'which holds no packages; build the workspace and source env.sh again.'
            yield False, f"AMENT_PREFIX_PATH names '{prefix}', {text}"


def _topics(graph: Graph) -> Iterator[tuple[str, list[str], list[Handle], list[Handle]]]:
    for name, types in graph.topics():
        if name not in _ALWAYS_THERE:
            yield name, types, graph.publishers(name), graph.subscriptions(name)


def _check_topics(graph: Graph) -> Iterator[Finding]:
    for name, types, publishers, subscriptions in _topics(graph):
        if len(types) > 1:
            yield True, f'{name} has several types: {", ".join(types)}.'
        if publishers and not subscriptions:
            yield False, f'Publisher without subscriber detected on {name}.'
        if subscriptions and not publishers:
            yield False, f'Subscriber without publisher detected on {name}.'


def _pairs(graph: Graph) -> Iterator[tuple[str, Handle, Handle, Handle, str]]:
    from rclpy.qos import qos_check_compatible

    for name, _, publishers, subscriptions in _topics(graph):
        for publisher in publishers:
            for subscription in subscriptions:
                fits = qos_check_compatible(publisher.qos_profile, subscription.qos_profile)
                yield name, publisher, subscription, *fits


def _check_qos(graph: Graph) -> Iterator[Finding]:
    for name, publisher, subscription, verdict, reason in _pairs(graph):
        if verdict.name == 'OK':
            continue
        pair = f'{publisher.node_name} -> {subscription.node_name}'
        text = f"found on topic '{name}' ({pair}): {_LEADING_WORD.sub('', reason)}"
        yield verdict.name == 'ERROR', f'QoS compatibility {verdict.name.lower()} {text}'


def _reports(graph: Graph) -> Iterator[tuple[str, Rows]]:
    from rclpy.utilities import get_rmw_implementation_identifier

    yield (
        'PLATFORM INFORMATION',
        [
            ('system', platform.system()),
            ('platform info', platform.platform()),
            ('release', platform.release()),
            ('processor', platform.machine()),
            ('python version', platform.python_version()),
        ],
    )
    yield (
        'ROS 2 INFORMATION',
        [each for each in sorted(os.environ.items()) if _SHOWN.match(each[0])],
    )
    yield (
        'RMW MIDDLEWARE',
        [
            ('middleware name', get_rmw_implementation_identifier()),
            ('domain', graph.session.node.context.get_domain_id()),
            ('nodes', len(graph.nodes(hidden=True)) - 1),
            ('own node', graph.session.node.get_name()),
        ],
    )
    rows: Rows = []
    for name, _, publishers, subscriptions in _topics(graph):
        rows.append(('topic', name))
        rows.append(('publisher count', len(publishers)))
        rows.append(('subscriber count', len(subscriptions)))
    yield 'TOPIC LIST', rows or [('topic', 'none')]
    rows = []
    for name, publisher, subscription, _, reason in _pairs(graph):
        rows.append(('topic [type]', f'{name} [{publisher.topic_type}]'))
        rows.append(('publisher node', publisher.node_name))
        rows.append(('subscriber node', subscription.node_name))
        rows.append(('compatibility status', reason or 'OK'))
    nothing = ('compatibility status', 'No publisher/subscriber pairs found')
    yield 'QOS COMPATIBILITY LIST', rows or [nothing]
