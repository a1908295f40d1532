# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 lifecycle nodes`, `get`, `list` and `set`."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
import sys

from ..aliases import Message
from ..cli.arguments import add_graph_arguments
from ..cli.errors import FrontendError, NoAnswerError
from ..ros.calls import call
from ..ros.graph import Graph, open_graph
from ..ros.names import NodeName
from ..ros.session import Session
from .node_argument import add_node_argument, find_node

_GET_STATE = 'lifecycle_msgs/srv/GetState'
_GET_TRANSITIONS = 'lifecycle_msgs/srv/GetAvailableTransitions'
_CHANGE_STATE = 'lifecycle_msgs/srv/ChangeState'


def _lifecycle_nodes(graph: Graph, hidden: bool) -> list[NodeName]:
    services = dict(graph.services(hidden=True))
    return [
        node
        for node in sorted(graph.nodes(hidden))
        if _GET_STATE in services.get(f'{node.full_name}/get_state', ())
    ]


class Nodes:
    """Output a list of nodes with lifecycle."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_graph_arguments(parser)
        parser.add_argument(
            '-a', '--all', action='store_true', help='Display all nodes even hidden ones'
        )
        parser.add_argument(
            '-c',
            '--count-nodes',
            action='store_true',
            help='Only display the number of nodes discovered',
        )

    def main(self, args: Namespace) -> None:
        """Print the nodes."""
        with open_graph(args) as graph:
            graph.settle()
            nodes = _lifecycle_nodes(graph, args.all)
        if args.count_nodes:
            print(len(nodes))
            return
        for node in nodes:
            print(node.full_name)


class Get:
    """Get lifecycle state for one or more nodes."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_node_argument(parser, optional=True)

    def main(self, args: Namespace) -> int:
        """Print the state of one node, or of all that have one.

        Returns:
            The exit code: 1 when the one node does not tell its state.

        Raises:
            UnknownNameError: When there is no such node.
        """
        hidden = args.include_hidden_nodes
        with open_graph(args) as graph:
            if args.node_name:
                state = _state(graph.session, find_node(args.node_name, graph, hidden))
                print(f'{state.label} [{state.id}]')
                return 0
            graph.settle()
            for node in _lifecycle_nodes(graph, hidden):
                _print_state(graph.session, node)
        return 0


def _print_state(session: Session, node: NodeName) -> None:
    try:
        state = _state(session, node)
    except NoAnswerError as error:
        print(error, file=sys.stderr)
    else:
        print(f'{node.full_name}: {state.label} [{state.id}]')


def _state(session: Session, node: NodeName) -> Message:
    return call(session, _GET_STATE, f'{node.full_name}/get_state').current_state


class List:
    """Output a list of available transitions."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_node_argument(parser)
        parser.add_argument(
            '-a', '--all', action='store_true', help='Display all existing transitions'
        )

    def main(self, args: Namespace) -> None:
        """Print the transitions that the node can make now, or all of its state machine.

        Raises:
            UnknownNameError: When there is no such node.
        """
        query = 'get_transition_graph' if args.all else 'get_available_transitions'
        with open_graph(args) as graph:
            node = find_node(args.node_name, graph, args.include_hidden_nodes)
            found = _transitions(graph.session, node, query)
        for entry in found:
            print(f'- {entry.transition.label} [{entry.transition.id}]')
            print(f'\tStart: {entry.start_state.label}')
            print(f'\tGoal: {entry.goal_state.label}')


def _transitions(
    session: Session, node: NodeName, query: str = 'get_available_transitions'
) -> list[Message]:
    response = call(session, _GET_TRANSITIONS, f'{node.full_name}/{query}')
    return list(response.available_transitions)


class Set:
    """Trigger lifecycle state transition."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_node_argument(parser)
        parser.add_argument('transition', help='The lifecycle transition')

    def main(self, args: Namespace) -> None:
        """Make the node go through a transition, named by label or number.

        Raises:
            UnknownNameError: When there is no such node.
            FrontendError: When it has no such transition now.
        """
        with open_graph(args) as graph:
            node = find_node(args.node_name, graph, args.include_hidden_nodes)
            found = [entry.transition for entry in _transitions(graph.session, node)]
            wanted = [t for t in found if args.transition in {t.label, str(t.id)}]
            if not wanted:
                listed = ''.join(f'\n- {t.label} [{t.id}]' for t in found)
                raise FrontendError(f'Unknown transition requested, available ones are:{listed}')
            service = f'{node.full_name}/change_state'
            success = call(graph.session, _CHANGE_STATE, service, transition=wanted[0]).success
        if success:
            print('Transitioning successful')
        else:
            print('Transitioning failed', file=sys.stderr)
