# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Calling services of other nodes."""

from __future__ import annotations

import importlib

from ..aliases import Handle, Message
from ..cli.errors import FrontendError, NoAnswerError
from .graph import Graph
from .session import Session

_TIMEOUT = 5.0  # [s] for a service of a node that exists to show up, and to answer


def request(
    session: Session, client: Handle, request_: Message, timeout: float | None = None
) -> Message:
    """Call a service by a client of rclpy and return the response.

    Raises:
        NoAnswerError: None came in `timeout` [s].
        FrontendError: The answer cannot be read.
    """
    future = client.call_async(request_)
    if not session.spin_until(future.done, timeout):
        raise NoAnswerError(f"Service '{client.srv_name}' did not answer within {timeout:g} s")
    if future.exception() is not None:
        raise FrontendError(f'Exception while calling service: {future.exception()!r}')
    return future.result()


def call(graph: Graph, type_name: str, name: str, **fields: object) -> Message:
    """Call a service that a node is known to offer, e.g. of `rcl_interfaces/srv/GetParameters`.

    Raises:
        NoAnswerError: The service did not appear or did not answer.
    """
    package, folder, base = type_name.split('/')
    service_type = getattr(importlib.import_module(f'{package}.{folder}'), base)
    client = graph.session.node.create_client(service_type, name)
    if not graph.wait_until(lambda: client.service_is_ready() or None, _TIMEOUT):
        raise NoAnswerError(f"Wait for service timed out: '{name}' did not appear")
    return request(graph.session, client, service_type.Request(**fields), _TIMEOUT)
