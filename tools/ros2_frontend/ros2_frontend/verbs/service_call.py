# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 service call`."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
import math
import sys
import time

from ..aliases import InterfaceClass, Message
from ..cli.arguments import add_graph_arguments, positive_float
from ..cli.errors import FieldValueError, NoAnswerError
from ..cli.suggest import hint
from ..index.interfaces import class_of, Kind
from ..messages.fill import Filler
from ..messages.from_text import parse_mapping
from ..ros.calls import Client
from ..ros.graph import Graph
from ..ros.names import absolute, is_hidden
from ..ros.session import open_session, Session

_GRACE = 0.02  # [s]; ros2cli, too, says nothing when the service is there at once


class Call:
    """Call a service."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_graph_arguments(parser)
        parser.add_argument(
            'service_name', help="Name of the ROS service to call to (e.g. '/add_two_ints')"
        )
        parser.add_argument(
            'service_type', help="Type of the ROS service (e.g. 'std_srvs/srv/Empty')"
        )
        content = parser.add_mutually_exclusive_group()
        content.add_argument(
            'values',
            nargs='?',
            default='{}',
            help="Values to fill the service request with in YAML format (e.g. '{a: 1, b: 2}'), "
            'otherwise the service request will be published with default values',
        )
        content.add_argument(
            '--stdin', action='store_true', help='Read values from standard input'
        )
        parser.add_argument(
            '-r',
            '--rate',
            metavar='N',
            type=positive_float,
            help='Repeat the call at a specific rate in Hz',
        )
        parser.add_argument(
            '--timeout',
            metavar='N',
            type=positive_float,
            help='Longest time [s] to wait for the service, and then for its answer '
            '(default: for ever)',
        )

    def main(self, args: Namespace) -> None:
        """Call once, or at a rate until Ctrl-C.

        Raises:
            BadTypeError: When the type is not installed or no service.
            FieldValueError: When the values do not fit the request.
            NoAnswerError: When `--timeout` passed.
        """
        service_type = class_of(
            args.service_type, Kind.SERVICE, 'The passed service type is invalid'
        )
        request = _request(service_type, sys.stdin.read() if args.stdin else args.values)
        with open_session(args) as session:
            client = Client(session, service_type, absolute(args.service_name))
            _await(client, session, args)
            while True:
                start = time.monotonic()
                print(f'requester: making request: {request!r}\n')
                print(f'response:\n{client.call(request, args.timeout)!r}\n')
                if args.rate is None:
                    return
                left = start + 1.0 / args.rate - time.monotonic()
                session.spin_until(lambda: False, left)


def _request(service_type: InterfaceClass, text: str) -> Message:
    request, values = service_type.Request(), parse_mapping(text)
    try:
        Filler().fill(request, values)
    except FieldValueError as error:
        raise FieldValueError(f'Failed to populate field: {error}') from None
    return request


def _await(client: Client, session: Session, args: Namespace) -> None:
    """Wait for the service; say so when it is not there at once, and what else is."""
    if client.wait(_GRACE):
        return
    print('waiting for service to become available...')
    start = time.monotonic()
    graph = Graph(session, args.spin_time)
    if graph.wait_for(lambda: client.is_ready() or None, args.timeout or math.inf):
        return
    name = client.name
    _explain(name, args.service_type, graph.offered_services())
    left = None if args.timeout is None else start + args.timeout - time.monotonic()
    if not graph.wait_until(lambda: client.is_ready() or None, left):
        raise NoAnswerError(f"Service '{name}' did not appear within {args.timeout:g} s")


def _explain(name: str, wanted: str, services: dict[str, list[str]]) -> None:
    """Tell on stderr why the wait may be in vain."""
    if name in services:
        offered = ', '.join(services[name])
        print(f"Service '{name}' has the type {offered}, not {wanted}", file=sys.stderr)
        return
    known = [other for other in services if is_hidden(name) or not is_hidden(other)]
    print(f"There is no service '{name}' yet.{hint(name, known)}", file=sys.stderr)
