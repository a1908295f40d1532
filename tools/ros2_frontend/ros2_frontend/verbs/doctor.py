# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 doctor`, also as `ros2 wtf`."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping
import os
import sys

from ..cli.arguments import add_graph_arguments
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
from ..ros.graph import Graph, open_graph
from ..ros.participants import read_ports


class Doctor:
    """Check ROS setup and other potential issues."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_graph_arguments(parser)
        parser.add_argument('--report', '-r', action='store_true', help='Print all reports.')
        parser.add_argument(
            '--report-failed',
            '-rf',
            action='store_true',
            help='Print reports of failed checks only.',
        )
        parser.add_argument(
            '--include-warnings',
            '-iw',
            action='store_true',
            help='Include warnings as failed checks. Warnings are ignored by default.',
        )
        parser.add_argument(
            '--exclude-packages',
            '-ep',
            action='store_true',
            help='Accepted and without effect: package versions are not checked',
        )

    def main(self, args: Namespace) -> None:
        """Look at everything and print what may be wrong; exit code 0, as ros2cli."""
        with open_graph(args) as graph:
            graph.settle()
            topics = read_topics(graph)
            discovery = _check_discovery(graph)
            reports = _reports(graph, topics)
        if args.report:
            for report in reports.values():
                print(report.text())
            return
        failed = _check(topics, discovery, args.include_warnings)
        if args.report_failed:
            for name in failed:
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
