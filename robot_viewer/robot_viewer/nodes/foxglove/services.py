# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Services as Foxglove sees them: called with CDR, answered with CDR."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Future as Answer
from concurrent.futures import InvalidStateError
from concurrent.futures import TimeoutError as AnswerTimeoutError
from contextlib import suppress
from functools import partial
import threading
import time
from typing import Any

from foxglove import MessageSchema, Schema, Service, ServiceRequest, ServiceSchema
from foxglove.websocket import WebSocketServer
from rclpy.client import Client
from rclpy.node import Node
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.task import Future

from message_definitions import DefinitionError, service_definitions

from .topics import class_of, is_hidden, NameFilter

ANSWER_TIMEOUT = 120.0
"""Longest time for an answer in [s]; homing takes long."""
MATCH_TIMEOUT = 3.0
"""Longest time until a new client and its service know each other in [s]."""
MATCH_PERIOD = 0.02
"""Time between two looks whether they do in [s]."""


class ServiceCallError(Exception):
    """A call without an answer; its words go to the client of Foxglove."""


class Services:
    """Offers services, in the thread of the node, and calls them, in those of the server.

    A client of ROS is made at the first call: there are hundreds of services, and each client is
    two endpoints of DDS.
    """

    def __init__(self, node: Node, shown: NameFilter, warn: Callable[[str], None]) -> None:
        self._node, self._shown, self._warn = node, shown, warn
        self._types: dict[str, str] = {}
        self._refused: set[tuple[str, str]] = set()
        self._clients: dict[str, Client] = {}
        self._lock = threading.Lock()
        self._unanswered: dict[Answer[bytes], str] = {}

    def look(self, server: WebSocketServer, services: Iterable[tuple[str, Sequence[str]]]) -> None:
        """Offer what has appeared, withdraw what has gone, by names and types of all services."""
        wanted = {
            name: types[0]
            for name, types in services
            if self._shown.accepts(name) and not is_hidden(name)
        }
        gone = [name for name, type_ in self._types.items() if wanted.get(name) != type_]
        if gone:
            server.remove_services(gone)
        for name in gone:
            del self._types[name]
            client = self._clients.pop(name, None)
            if client is not None:
                self._node.destroy_client(client)
                self._abandon(name, f'{name} has gone')
        made = [self._offered(name, type_) for name, type_ in wanted.items()]
        new = [service for service in made if service is not None]
        if new:
            server.add_services(new)

    def close(self) -> None:
        """Fail all waiting calls."""
        for name in set(self._unanswered.values()):
            self._abandon(name, 'the bridge ends')

    def _abandon(self, name: str, reason: str) -> None:
        for answer, service in list(self._unanswered.items()):
            if service == name:
                _fail(answer, reason)

    def _offered(self, name: str, type_: str) -> Service | None:
        if self._types.get(name) == type_ or (name, type_) in self._refused:
            return None
        try:
            kind = class_of(type_)
            definitions = service_definitions(type_)
        except (DefinitionError, LookupError) as error:
            self._refused.add((name, type_))
            self._warn(f'service {name} is not offered: {error}')
            return None
        self._types[name] = type_
        schema = ServiceSchema(
            type_,
            request=_schema(f'{type_}_Request', definitions.request),
            response=_schema(f'{type_}_Response', definitions.response),
        )
        return Service(name, schema=schema, handler=partial(self._handle, kind))

    def _handle(self, kind: Any, request: ServiceRequest) -> bytes:  # noqa: ANN401
        """Call a service and wait; in a thread of the server that is for this call alone."""
        name = request.service_name
        try:
            message = deserialize_message(request.payload, kind.Request)
        except Exception:  # noqa: BLE001  # rclpy has an error of its own for each middleware
            raise ServiceCallError(f'{name}: what came is no request of it in CDR') from None
        with self._lock:
            client = self._clients.get(name)
            if client is None:
                client = self._clients[name] = self._node.create_client(kind, name)
        deadline = time.monotonic() + MATCH_TIMEOUT
        while not client.service_is_ready():
            if time.monotonic() > deadline:
                raise ServiceCallError(f'{name} does not answer; its node has gone, perhaps')
            time.sleep(MATCH_PERIOD)
        answer: Answer[bytes] = Answer()
        self._unanswered[answer] = name
        try:
            client.call_async(message).add_done_callback(partial(_answered, answer))
            return answer.result(ANSWER_TIMEOUT)
        except AnswerTimeoutError:
            answer.cancel()  # whatever comes now is late
            raise ServiceCallError(f'{name}: no answer within {ANSWER_TIMEOUT:g} s') from None
        finally:
            self._unanswered.pop(answer, None)


def _answered(answer: Answer[bytes], future: Future) -> None:
    if future.exception() is not None:
        _fail(answer, str(future.exception()))
    elif future.result() is None:
        _fail(answer, 'the call was cancelled')
    else:
        with suppress(InvalidStateError):  # nobody waits any longer
            answer.set_result(serialize_message(future.result()))


def _fail(answer: Answer[bytes], reason: str) -> None:
    with suppress(InvalidStateError):
        answer.set_exception(ServiceCallError(reason))


def _schema(name: str, definition: str) -> MessageSchema:
    schema = Schema(name=name, encoding='ros2msg', data=definition.encode())
    return MessageSchema(encoding='cdr', schema=schema)
