# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 lifecycle nodes`, `get`, `list` and `set`."""

from __future__ import annotations

from argparse import Namespace
import sys

from ..cli.commands import argument, flag, FrontendError, NoAnswerError
from ..names import Message, NodeName
from ..ros.graph import call, Graph, graph_verb
from .node import find_node, LIST_ARGUMENTS, node_verb, OPTIONAL_NODE

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


@graph_verb(*LIST_ARGUMENTS)
def nodes(graph: Graph, args: Namespace) -> None:
    """Print the lifecycle nodes."""
    graph.settle()
    found = _lifecycle_nodes(graph, args.all)
    for line in [len(found)] if args.count_nodes else [node.full_name for node in found]:
        print(line)


@graph_verb(*OPTIONAL_NODE)
def get(graph: Graph, args: Namespace) -> None:
    """Print the state of one node, or of all lifecycle nodes."""
    if args.node_name:
        node = find_node(args.node_name, graph, args.include_hidden_nodes)
        print(_state(graph, node))
        return
    graph.settle()
    for node in _lifecycle_nodes(graph, args.include_hidden_nodes):
        try:
            print(f'{node.full_name}: {_state(graph, node)}')
        except NoAnswerError as error:  # noqa: PERF203  # the others may answer
            print(error, file=sys.stderr)


def _state(graph: Graph, node: NodeName) -> str:
    state = call(graph, _GET_STATE, f'{node.full_name}/get_state').current_state
    return f'{state.label} [{state.id}]'


@node_verb(flag('-a', '--all', help='Display all existing transitions'))
def list_transitions(graph: Graph, node: NodeName, args: Namespace) -> None:
    """Print the transitions available in the node's current state, or all transitions."""
    query = 'get_transition_graph' if args.all else 'get_available_transitions'
    for entry in _transitions(graph, node, query):
        print(f'- {entry.transition.label} [{entry.transition.id}]')
        print(f'\tStart: {entry.start_state.label}')
        print(f'\tGoal: {entry.goal_state.label}')


def _transitions(
    graph: Graph, node: NodeName, query: str = 'get_available_transitions'
) -> list[Message]:
    response = call(graph, _GET_TRANSITIONS, f'{node.full_name}/{query}')
    return list(response.available_transitions)


@node_verb(argument('transition', help='The lifecycle transition'))
def set_state(graph: Graph, node: NodeName, args: Namespace) -> None:
    """Trigger a transition of the node, by label or number."""
    found = [entry.transition for entry in _transitions(graph, node)]
    wanted = [t for t in found if args.transition in {t.label, str(t.id)}]
    if not wanted:
        listed = ''.join(f'\n- {t.label} [{t.id}]' for t in found)
        raise FrontendError(f'Unknown transition requested, available ones are:{listed}')
    service = f'{node.full_name}/change_state'
    if call(graph, _CHANGE_STATE, service, transition=wanted[0]).success:
        print('Transitioning successful')
    else:
        print('Transitioning failed', file=sys.stderr)
