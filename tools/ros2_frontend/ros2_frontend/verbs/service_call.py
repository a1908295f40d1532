# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 service call`."""

from __future__ import annotations

from argparse import Namespace
import math
import sys
import time

from ..cli.arguments import content, GRAPH_ARGUMENTS, positive_float
from ..cli.errors import NoAnswerError
from ..cli.suggest import hint
from ..cli.verb import argument, verb
from ..index.interfaces import class_of, Kind
from ..messages.fill import filled
from ..ros.calls import Client
from ..ros.graph import Graph, open_graph
from ..ros.names import absolute, is_hidden
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
    """Call once, or at a rate until Ctrl-C.

    Raises:
        BadTypeError: When the type is not installed or no service.
        FieldValueError: When the values do not fit the request.
        NoAnswerError: When `--timeout` passed.
    """
    type_ = class_of(args.service_type, Kind.SERVICE, 'The passed service type is invalid')
    request = filled(type_.Request(), sys.stdin.read() if args.stdin else args.values)
    with open_graph(args) as graph:
        client = Client(graph.session, type_, absolute(args.service_name))
        _await(client, graph, args)
        while True:
            start = time.monotonic()
            print(f'requester: making request: {request!r}\n')
            print(f'response:\n{client.call(request, args.timeout)!r}\n')
            if args.rate is None:
                return
            left = start + 1.0 / args.rate - time.monotonic()
            graph.session.spin_until(lambda: False, left)


def _await(client: Client, graph: Graph, args: Namespace) -> None:
    """Wait for the service; print it when it is not there at once, and what else is."""
    if client.wait(_GRACE):
        return
    print('waiting for service to become available...')
    start = time.monotonic()
    if graph.wait_for(lambda: client.is_ready() or None, args.timeout or math.inf):
        return
    name = client.name
    _explain(name, args.service_type, graph.offered_services())
    left = None if args.timeout is None else start + args.timeout - time.monotonic()
    if not graph.wait_until(lambda: client.is_ready() or None, left):
        raise NoAnswerError(f"Service '{name}' did not appear within {args.timeout:g} s")


def _explain(name: str, wanted: str, services: dict[str, list[str]]) -> None:
    """Print on stderr why the wait may be in vain."""
    if wanted in services.get(name, ()):
        return  # discovery has the service, and has not matched its endpoints yet
    if name in services:
        offered = ', '.join(services[name])
        print(f"Service '{name}' has the type {offered}, not {wanted}", file=sys.stderr)
        return
    known = [other for other in services if is_hidden(name) or not is_hidden(other)]
    print(f"There is no service '{name}' yet.{hint(name, known)}", file=sys.stderr)
