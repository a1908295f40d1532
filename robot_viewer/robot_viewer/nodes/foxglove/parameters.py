# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of other nodes: read once, kept up to date by /parameter_events, and set."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Future as Answer
from concurrent.futures import InvalidStateError, wait
from contextlib import suppress
from functools import partial
from typing import Any

from foxglove import Parameter as Shown
from rcl_interfaces.msg import Parameter, ParameterEvent
from rcl_interfaces.msg import ParameterValue as RosValue
from rcl_interfaces.srv import GetParameters, ListParameters, SetParameters
from rclpy.client import Client
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from rclpy.parameter import parameter_value_to_python
from rclpy.qos import qos_profile_parameter_events
from rclpy.task import Future

from ...foxglove.names import NameFilter
from ...foxglove.parameter_values import (
    fitted,
    full_name,
    ParameterTable,
    ParameterValueError,
    split_name,
    Value,
)

LIST_TYPE = 'rcl_interfaces/srv/ListParameters'
LIST_SUFFIX = '/list_parameters'
SET_TIMEOUT = 1.0
"""Longest time in [s] for which the messages of a client wait for the parameters that it sets."""
MATCH_PERIOD = 0.02
MATCH_TRIES = 150  # 3 s until a new client and its service know each other


class Parameters:
    """Knows the parameters of all nodes but its own; what has no other note is for its thread."""

    def __init__(
        self,
        node: Node,
        shown: NameFilter,
        order: Callable[[Callable[[], None]], None],
        publish: Callable[[list[Shown]], None],
        warn: Callable[[str], None],
    ) -> None:
        """Know nothing yet.

        Args:
            node: Whose clients they are.
            shown: Full names, `/node.parameter`.
            order: Has something done in the thread of the node.
            publish: Takes values that have changed.
            warn: Takes what is refused, in words.
        """
        self._node, self._order, self._publish, self._warn = node, order, publish, warn
        self._shown = shown
        self._table = ParameterTable(shown.accepts)
        self._nodes: set[str] = set()
        node.create_subscription(
            ParameterEvent, '/parameter_events', self._update, qos_profile_parameter_events
        )

    def look(self, services: Iterable[tuple[str, Sequence[str]]]) -> None:
        """Read the parameters of nodes that have appeared, once; forget those that have gone.

        Args:
            services: Names and types of all services in the graph.
        """
        found = {
            name.removesuffix(LIST_SUFFIX)
            for name, types in services
            if name.endswith(LIST_SUFFIX) and LIST_TYPE in types
        } - {self._node.get_fully_qualified_name()}
        for gone in self._nodes - found:
            self._table.forget(gone)
        new = found - self._nodes
        self._nodes = found
        for node in sorted(new):
            self._read(node)

    def get(self, names: Sequence[str]) -> list[Shown]:
        """Return parameters as they were last reported, all when no name is given; any thread."""
        return _shown(self._table.get(names))

    def set(self, wanted: Iterable[Shown]) -> list[Shown]:
        """Set parameters; return what they are then. In threads of the server, where it waits."""
        names, by_node = [], defaultdict[str, list[Parameter]](list)
        for each in wanted:
            names.append(each.name)
            try:
                node, parameter = self._accepted(each)
            except ParameterValueError as error:
                self._order(partial(self._warn, f'not set: {error}'))
            else:
                by_node[node].append(parameter)
        answers: dict[str, Answer[None]] = {node: Answer() for node in by_node}
        for node, answer in answers.items():
            self._order(partial(self._set, node, by_node[node], answer))
        unanswered = wait(answers.values(), SET_TIMEOUT).not_done
        for node in [node for node, answer in answers.items() if answer in unanswered]:
            self._order(partial(self._warn, f'{node}: no answer within {SET_TIMEOUT:g} s'))
        return self.get(names) if names else []

    def _accepted(self, wanted: Shown) -> tuple[str, Parameter]:
        """Return the node, and the parameter as it is set there.

        Raises:
            ParameterValueError: It is not shown, or cannot have the value.
        """
        if not self._shown.accepts(wanted.name):
            raise ParameterValueError(f'{wanted.name} is not in param_whitelist')
        node, name = split_name(wanted.name)
        present = self._table.get([wanted.name]).get(wanted.name)
        return node, _ros_parameter(name, fitted(wanted.name, wanted.get_value(), present))

    def _read(self, node: str) -> None:
        lister = self._node.create_client(ListParameters, f'{node}{LIST_SUFFIX}')
        getter = self._node.create_client(GetParameters, f'{node}/get_parameters')

        def listed(response: Any) -> None:  # noqa: ANN401
            names = list(response.result.names)
            request = GetParameters.Request(names=names)
            self._call(getter, request, partial(self._take, node, names))

        self._call(lister, ListParameters.Request(), listed)

    def _take(self, node: str, names: Sequence[str], response: Any) -> None:  # noqa: ANN401
        values = zip(names, response.values, strict=False)
        self._table.update({full_name(node, name): _python(value) for name, value in values})

    def _set(self, node: str, parameters: list[Parameter], answer: Answer[None]) -> None:
        client = self._node.create_client(SetParameters, f'{node}/set_parameters')

        def done(response: Any) -> None:  # noqa: ANN401
            accepted: dict[str, Value | None] = {}
            for parameter, result in zip(parameters, response.results, strict=False):
                name = full_name(node, parameter.name)
                if result.successful:
                    accepted[name] = _python(parameter.value)
                else:
                    self._warn(f'{name} was refused: {result.reason or "no reason given"}')
            self._table.update(accepted)
            with suppress(InvalidStateError):
                answer.set_result(None)

        self._call(client, SetParameters.Request(parameters=parameters), done)

    def _call(
        self,
        client: Client,
        request: Any,  # noqa: ANN401
        done: Callable[[Any], None],
    ) -> None:
        """Call a service once it is known, and destroy the client."""
        tries = MATCH_TRIES

        def answered(future: Future) -> None:
            self._node.destroy_client(client)
            if future.exception() is None and future.result() is not None:
                done(future.result())

        def attempt() -> None:
            nonlocal tries
            tries -= 1
            if client.service_is_ready():
                self._node.destroy_timer(timer)
                client.call_async(request).add_done_callback(answered)
            elif not tries:
                self._node.destroy_timer(timer)
                self._node.destroy_client(client)

        timer = self._node.create_timer(MATCH_PERIOD, attempt)

    def _update(self, event: ParameterEvent) -> None:
        changed = [*event.new_parameters, *event.changed_parameters]
        values = {full_name(event.node, each.name): _python(each.value) for each in changed}
        values.update(
            {full_name(event.node, each.name): None for each in event.deleted_parameters}
        )
        if event.node in self._nodes:
            taken = self._table.update(values)
            self._publish(_shown(taken))


def _python(value: RosValue) -> Value | None:
    found = parameter_value_to_python(value)
    if isinstance(found, list) and found and isinstance(found[0], bytes):
        return b''.join(found)
    return found if found is None or isinstance(found, bool | int | float | str) else list(found)


def _ros_parameter(name: str, value: Value) -> Parameter:
    bare = [bytes([each]) for each in value] if isinstance(value, bytes) else value
    return RosParameter(name, value=bare).to_parameter_msg()


def _shown(values: Mapping[str, Any]) -> list[Shown]:
    return [Shown(name, value=value) for name, value in values.items()]
