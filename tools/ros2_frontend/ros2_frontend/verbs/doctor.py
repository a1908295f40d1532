# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 doctor`, also as `ros2 wtf`."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Mapping
import os
import sys

from ..cli.verb import flag
from ..health.environment import check_environment, report_environment, report_platform
from ..health.findings import error, Finding, Report, Severity
from ..health.network import check_network, read_interfaces, report_network
from ..health.topics import (
    check_qos,
    check_topics,
    read_topics,
    report_qos,
    report_topics,
    Topic,
)
from ..ros.discovery import take_census
from ..ros.graph import Graph, graph_verb
from ..ros.participants import read_ports


@graph_verb(
    flag('--report', '-r', help='Print all reports.'),
    flag('--report-failed', '-rf', help='Print reports of failed checks only.'),
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
    """Look at everything and print what may be wrong; exit code 0, as ros2cli."""
    graph.settle()
    topics = read_topics(graph)
    reports = _reports(graph, topics)
    if args.report:
        wanted = list(reports)
    else:
        failed = _check(topics, _check_discovery(graph), args.include_warnings)
        wanted = failed if args.report_failed else []
    for name in wanted:
        print(reports[name].text())


def _check(topics: list[Topic], discovery: list[Finding], include_warnings: bool) -> list[str]:
    """Run all checks, print findings and verdict, and answer the names of those that failed."""
    results = {
        'environment': list(check_environment(os.environ)),
        'network': list(check_network(read_interfaces())),
        'discovery': discovery,
        'topic': list(check_topics(topics)),
        'middleware': list(check_qos(topics)),
    }
    for name, findings in results.items():
        for finding in findings:
            print(f'\n{name}: {finding.severity.value}: {finding.text}', file=sys.stderr)
    failed = [name for name, found in results.items() if _fails(found, include_warnings)]
    if failed:
        print(f'\n{len(failed)}/{len(results)} check(s) failed\n')
        print('Failed modules:', *failed)
    else:
        print(f'\nAll {len(results)} checks passed\n')
    return failed


def _fails(findings: list[Finding], include_warnings: bool) -> bool:
    return any(include_warnings or found.severity is Severity.ERROR for found in findings)


def _check_discovery(graph: Graph) -> list[Finding]:
    missing = take_census(graph, read_ports(graph.domain_id)).missing
    if not missing:
        return []
    return [
        error(
            f'{missing} process(es) of this domain on this host cannot be seen. They may be no '
            'ROS nodes, use another RMW_IMPLEMENTATION, or belong to another container or user.'
        )
    ]


def _reports(graph: Graph, topics: list[Topic]) -> Mapping[str, Report]:
    """The reports by the name of the check that they belong to."""
    from rclpy.utilities import get_rmw_implementation_identifier

    ports = read_ports(graph.domain_id)
    discovery = Report(
        'RMW MIDDLEWARE',
        (
            ('middleware name', get_rmw_implementation_identifier()),
            ('domain', graph.domain_id),
            ('participants on this host', ports.count),
            ('nodes', len(graph.nodes(hidden=True)) - 1),
            ('own node', graph.session.node.get_name()),
        ),
    )
    return {
        'platform': report_platform(),
        'environment': report_environment(os.environ),
        'network': report_network(read_interfaces()),
        'discovery': discovery,
        'topic': report_topics(topics),
        'middleware': report_qos(topics),
    }
