# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The ROS graph as one node sees it, and how commands wait for discovery.

There is no daemon: each command joins the graph anew, and waits as long as ros2cli without its
daemon. By then all nodes of this host are known, because their profile (`dds_network`) makes them
announce themselves often. A list waits longer while a participant of this host is not yet
identified as ROS: nodes are late on a busy machine, and DDS of another vendor takes up to 0.8 s. A
command for one name continues as soon as that appears, and waits a little longer if it does not.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Iterator
import contextlib
import gc
import importlib
import math
import os
import time
from typing import TypeVar

from dds_network import (
    is_this_host,
    NETWORK_VARIABLE,
    NetworkChoiceError,
    participants_on_this_host,
    restrict_dds,
)
from message_definitions import load_type_support

from ..cli.commands import Argument, FrontendError, GRAPH_ARGUMENTS, NoAnswerError, Verb
from ..cli.interrupts import deferred_interrupts
from ..names import Handle, is_hidden, Message, NamesAndTypes, NodeName
from .joining import ARGUMENTS, early_context, NODE_PREFIX

# Python sees Ctrl-C only between two waits
_LONGEST_WAIT = 0.1  # [s]


class Session:
    """One ROS context with one hidden node, for the life of one command.

    It does not install rclpy's signal handlers: a command ends by `KeyboardInterrupt`, with a
    context that still works (so `action send_goal` can cancel its goal), and always removes its
    participant from the graph. Executor: `SingleThreadedExecutor`; the multi-threaded one runs
    callbacks repeatedly, and the unbounded spin of the events executor burns a core (rclpy 7.1.6).
    """

    def __init__(self, node: Handle, executor: Handle) -> None:
        self.node = node
        self._executor = executor

    def spin_once(self, timeout: float = _LONGEST_WAIT) -> None:
        """Wait for one callback, at most `timeout` [s], and run it."""
        with deferred_interrupts():
            self._executor.spin_once(timeout_sec=min(timeout, _LONGEST_WAIT))

    def spin_until(self, done: Callable[[], bool], timeout: float | None = None) -> bool:
        """Run callbacks until a condition holds; return False after `timeout` in [s]."""
        deadline = None if timeout is None else time.monotonic() + timeout
        while not done():
            left = _LONGEST_WAIT if deadline is None else deadline - time.monotonic()
            if left <= 0.0:
                return False
            self.spin_once(left)
        return True

    def spin(self) -> None:
        """Run callbacks until Ctrl-C."""
        while True:
            self.spin_once()


@contextlib.contextmanager
def open_session(args: Namespace, node_name: str | None = None) -> Iterator[Session]:
    """Join the ROS graph for one command with a node that leaves it afterwards.

    Without a name, the node is hidden.

    Raises:
        FrontendError: The node's name, or another that the session uses, is malformed.
    """
    load_type_support()
    import rclpy
    from rclpy.context import Context
    from rclpy.exceptions import NameValidationException
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.impl.implementation_singleton import rclpy_implementation
    from rclpy.node import Node as RclpyNode
    from rclpy.parameter import Parameter
    from rclpy.signals import SignalHandlerOptions
    from rclpy.validate_node_name import validate_node_name

    try:
        restrict_dds(os.environ)
    except NetworkChoiceError as error:
        raise FrontendError(f'{NETWORK_VARIABLE}: {error}') from None
    context = Context()
    with early_context(rclpy_implementation) as end_early_node:
        rclpy.init(  # noqa: TID251  # restricted above
            args=list(ARGUMENTS),
            context=context,
            signal_handler_options=SignalHandlerOptions.NO,
        )
    try:
        sim_time = getattr(args, 'use_sim_time', False)
        name = node_name or f'{NODE_PREFIX}_{os.getpid()}'
        validate_node_name(name)  # Node() would clean up after itself, with a warning
        node = RclpyNode(
            name,
            context=context,
            start_parameter_services=False,
            parameter_overrides=[Parameter('use_sim_time', value=True)] if sim_time else None,
        )
        end_early_node()
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        gc.enable()  # main() leaves it off for the imports
        try:
            yield Session(node, executor)
        finally:
            executor.shutdown(timeout_sec=0.0)
            node.destroy_node()
    except NameValidationException as error:
        raise FrontendError(str(error)) from None
    finally:
        context.try_shutdown()


T = TypeVar('T')

_SPIN_TIME = 0.5  # [s] as ros2cli
_LATE_TIME = 1.0  # [s] while a participant of this host is not known
_NAME_TIME = 1.5  # [s] until a name is missing: on a machine that is too busy, discovery is late
# [s]; with Fast DDS's own profile, participants announce themselves every 3 s
_OPEN_SPIN_TIME = 3.2
_POLL = 0.01  # [s]; one look costs below 1 ms with 30 topics
_MAX_POLL = 0.25  # [s]
_POLL_SHARE = 0.02  # of the time waited so far: a wait of minutes shall not burn a core

_TIMEOUT = 5.0  # [s] for a service of a node that exists to show up, and to answer


class Graph:
    """Contents of the ROS graph."""

    def __init__(self, session: Session, spin_time: float | None = None) -> None:
        """Start discovery, which takes `spin_time` in [s]; None for the default."""
        self.session = session  # the session that looks; its node is part of the graph
        self._node = session.node
        fast = spin_time is None and is_this_host(os.environ)
        longest = _OPEN_SPIN_TIME if spin_time is None else spin_time
        begin = time.monotonic()
        self._complete = begin + (_SPIN_TIME if fast else longest)
        self._late = begin + (_LATE_TIME if fast else longest)
        self._missing = begin + (_NAME_TIME if fast else longest)

    def nodes(self, hidden: bool = False) -> list[NodeName]:
        """Return the nodes, unordered, with duplicates."""
        names = [NodeName.of(*pair) for pair in self._node.get_node_names_and_namespaces()]
        return [name for name in names if hidden or not name.hidden]

    def topics(self, hidden: bool = False) -> NamesAndTypes:
        """Return the topics and their types, sorted by name."""
        return _visible(self._node.get_topic_names_and_types(), hidden)

    def services(self, hidden: bool = False) -> NamesAndTypes:
        """Return the services and types, sorted by name, even those that have only clients."""
        return _visible(self._node.get_service_names_and_types(), hidden)

    def offered_services(self) -> dict[str, list[str]]:
        """Return the types, by name, of the services that have a server."""
        from rclpy.node import NodeNameNonExistentError

        found: dict[str, list[str]] = {}
        for node in self.nodes(hidden=True):
            with contextlib.suppress(NodeNameNonExistentError):  # it left meanwhile
                query = self._node.get_service_names_and_types_by_node
                found.update(query(node.name, node.namespace))
        return found

    def publishers(self, topic: str) -> list[Handle]:
        """Return a `TopicEndpointInfo` for each publisher of a topic."""
        return list(self._node.get_publishers_info_by_topic(topic))

    def subscriptions(self, topic: str) -> list[Handle]:
        """Return a `TopicEndpointInfo` for each subscription of a topic."""
        return list(self._node.get_subscriptions_info_by_topic(topic))

    def settle(self, meanwhile: Callable[[], None] = lambda: None) -> None:
        """Wait until the discovery time has passed; longer for an unidentified participant."""
        _wait(meanwhile, self._complete)
        _wait(lambda: self._knows_this_host() or None, self._late)

    def _knows_this_host(self) -> bool:
        # each participant of ROS publishes this topic, whichever vendor's DDS it uses; the names
        # of its nodes come by it, a little later
        known = self._node.get_publishers_info_by_topic('ros_discovery_info', no_mangle=True)
        participants = participants_on_this_host(self._node.context.get_domain_id())
        return len(self.nodes(hidden=True)) >= len(known) >= participants

    def wait_for(self, look: Callable[[], T | None], timeout: float = math.inf) -> T | None:
        """Return the result of `look`; None if surely missing, or after `timeout` in [s]."""
        return _wait(look, min(self._missing, time.monotonic() + timeout))

    def wait_until(self, look: Callable[[], T | None], timeout: float | None = None) -> T | None:
        """Return the result of `look`, without limit; None only after `timeout` in [s]."""
        return _wait(look, time.monotonic() + (math.inf if timeout is None else timeout))


def _wait(look: Callable[[], T | None], deadline: float) -> T | None:
    begin = time.monotonic()
    while (found := look()) is None and (now := time.monotonic()) < deadline:
        time.sleep(min(max(_POLL, _POLL_SHARE * (now - begin)), _MAX_POLL, deadline - now))
    return found


def _visible(pairs: NamesAndTypes, hidden: bool) -> NamesAndTypes:
    return [(name, types) for name, types in sorted(pairs) if hidden or not is_hidden(name)]


@contextlib.contextmanager
def open_graph(args: Namespace) -> Iterator[Graph]:
    """Join the ROS graph for one command with parsed `GRAPH_ARGUMENTS`, and discover it."""
    with open_session(args) as session:
        yield Graph(session, args.spin_time)


def graph_verb(*arguments: Argument) -> Callable[[Callable[[Graph, Namespace], int | None]], Verb]:
    """Decorate a function that reads the ROS graph as a verb, with `GRAPH_ARGUMENTS` added."""

    def declare(run: Callable[[Graph, Namespace], int | None]) -> Verb:
        def main(args: Namespace) -> int | None:
            with open_graph(args) as graph:
                return run(graph, args)

        return Verb((*GRAPH_ARGUMENTS, *arguments), main)

    return declare


def request(
    session: Session, client: Handle, request_: Message, timeout: float | None = None
) -> Message:
    """Call a service by a client of rclpy and return the response.

    Raises:
        NoAnswerError: No response arrived in `timeout` in [s].
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


def action_names(graph: Graph) -> NamesAndTypes:
    """Return the actions and their types, sorted by name."""
    from rclpy.action.graph import get_action_names_and_types

    return sorted(get_action_names_and_types(graph.session.node))


def offered_actions(graph: Graph) -> set[str]:
    """Return the actions that have a server; `action_names` includes those with only clients."""
    return {name for name, _ in action_names(graph) if clients_and_servers(graph, name)[1]}


def clients_and_servers(graph: Graph, action: str) -> tuple[NamesAndTypes, NamesAndTypes]:
    """Return the client nodes and the server nodes of an action, with their types."""
    from rclpy.action.graph import (
        get_action_client_names_and_types_by_node,
        get_action_server_names_and_types_by_node,
    )

    return (
        _nodes_with(get_action_client_names_and_types_by_node, graph, action),
        _nodes_with(get_action_server_names_and_types_by_node, graph, action),
    )


def _nodes_with(
    query: Callable[[Handle, str, str], NamesAndTypes], graph: Graph, action: str
) -> NamesAndTypes:
    from rclpy.node import NodeNameNonExistentError

    found: NamesAndTypes = []
    for node in sorted(graph.nodes(hidden=True)):
        try:
            types = dict(query(graph.session.node, node.name, node.namespace)).get(action)
        except NodeNameNonExistentError:  # it left meanwhile
            continue
        if types:
            found.append((node.full_name, types))
    return found
