# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 service call`."""

from __future__ import annotations

from argparse import Namespace
import math
import sys
import time

from ..cli.commands import (
    argument,
    content,
    GRAPH_ARGUMENTS,
    hint,
    NoAnswerError,
    positive_float,
    verb,
)
from ..index import class_of, Kind
from ..messages.fill import filled
from ..names import absolute, Handle, is_hidden
from ..ros.graph import Graph, open_graph
from ..ros.graph import request as send
from .service import SERVICES

_GRACE = 0.02  # [s]; ros2cli, too, prints nothing when the service is there at once


@verb(
    *GRAPH_ARGUMENTS,
    SERVICES.name_argument('call to', '/add_two_ints'),
    argument('service_type', help="Type of the ROS service (e.g. 'std_srvs/srv/Empty')"),
    content(
        'values',
        "Values to fill the service request with in YAML format (e.g. '{a: 1, b: 2}'), "
        'otherwise the service request will be published with default values',
        'Read values from standard input',
    ),
    argument(
        '-r',
        '--rate',
        metavar='N',
        type=positive_float,
        help='Repeat the call at a specific rate in Hz',
    ),
    argument(
        '--timeout',
        metavar='N',
        type=positive_float,
        help='Longest time [s] to wait for the service, and then for its answer '
        '(default: without limit)',
    ),
)
def call(args: Namespace) -> None:
    """Call once, or at a rate until Ctrl-C."""
    values = sys.stdin.read() if args.stdin else args.values
    with open_graph(args) as graph:  # it discovers others while type and values are loaded
        type_ = class_of(args.service_type, Kind.SERVICE, 'The passed service type is invalid')
        request = filled(type_.Request(), values)
        client = graph.session.node.create_client(type_, absolute(args.service_name))
        _await(client, graph, args)
        while True:
            start = time.monotonic()
            print(f'requester: making request: {request!r}\n')
            print(f'response:\n{send(graph.session, client, request, args.timeout)!r}\n')
            if args.rate is None:
                return
            left = start + 1.0 / args.rate - time.monotonic()
            graph.session.spin_until(lambda: False, left)


def _await(client: Handle, graph: Graph, args: Namespace) -> None:
    """Wait for the service; unless it is there at once, print that and what else exists."""

    def ready() -> bool | None:
        return client.service_is_ready() or None

    if graph.wait_for(ready, _GRACE):
        return
    print('waiting for service to become available...')
    start = time.monotonic()
    if graph.wait_for(ready, args.timeout or math.inf):
        return
    name, services = absolute(args.service_name), graph.offered_services()
    if name not in services:
        known = [other for other in services if is_hidden(name) or not is_hidden(other)]
        print(f"There is no service '{name}' yet.{hint(name, known)}", file=sys.stderr)
    elif args.service_type not in services[name]:  # else its endpoints are not matched yet
        offered = ', '.join(services[name])
        print(f"Service '{name}' has the type {offered}, not {args.service_type}", file=sys.stderr)
    left = None if args.timeout is None else start + args.timeout - time.monotonic()
    if not graph.wait_until(ready, left):
        raise NoAnswerError(f"Service '{name}' did not appear within {args.timeout:g} s")
