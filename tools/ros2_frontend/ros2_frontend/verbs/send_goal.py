# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 action send_goal`."""

from __future__ import annotations

from argparse import Namespace
import sys

from ..cli.commands import argument, content, flag, FrontendError, GRAPH_ARGUMENTS, hint, verb
from ..index import class_of, Kind
from ..messages.fill import filled, to_document, to_yaml
from ..names import absolute, Handle, Message
from ..ros.graph import Graph, offered_actions, open_graph, Session

_CANCEL_TIMEOUT = 5.0  # [s]

# action_msgs/msg/GoalStatus
_STATUS = {
    1: 'ACCEPTED',
    2: 'EXECUTING',
    3: 'CANCELING',
    4: 'SUCCEEDED',
    5: 'CANCELED',
    6: 'ABORTED',
}


@verb(
    *GRAPH_ARGUMENTS,
    argument('action_name', help="Name of the ROS action (e.g. '/fibonacci')"),
    argument(
        'action_type', help="Type of the ROS action (e.g. 'example_interfaces/action/Fibonacci')"
    ),
    content(
        'goal',
        "Goal request values in YAML format (e.g. '{order: 10}')",
        'Read goal from standard input',
    ),
    flag('-f', '--feedback', help='Echo feedback messages for the goal'),
)
def send_goal(args: Namespace) -> None:
    """Send the goal and wait for its result; Ctrl-C cancels it."""
    type_ = class_of(args.action_type, Kind.ACTION, 'The passed action type is invalid')
    text = sys.stdin.read() if args.stdin else args.goal
    goal = filled(type_.Goal(), text, what='message fields')
    from rclpy.action.client import ActionClient

    with open_graph(args) as graph:
        client = ActionClient(graph.session.node, type_, absolute(args.action_name))
        try:
            _await_server(client, graph, absolute(args.action_name))
            print(f'Sending goal:\n     {_yaml(goal)}')
            sent = client.send_goal_async(goal, _print_feedback if args.feedback else None)
            try:
                _follow(sent, graph.session)
            except BaseException:  # whatever interrupts the wait cancels the goal
                _cancel(sent, graph.session)
                raise
        finally:
            client.destroy()


def _await_server(client: Handle, graph: Graph, name: str) -> None:
    print('Waiting for an action server to become available...')
    if graph.wait_for(lambda: client.server_is_ready() or None):
        return
    known = offered_actions(graph)
    if name not in known:
        print(f"There is no action '{name}' yet.{hint(name, known)}", file=sys.stderr)
    graph.wait_until(lambda: client.server_is_ready() or None)


def _follow(sent: Handle, session: Session) -> None:
    handle = _result_of(sent, session)
    if not handle.accepted:
        print('Goal was rejected.')
        return
    print(f'Goal accepted with ID: {bytes(handle.goal_id.uuid).hex()}\n')
    result = _result_of(handle.get_result_async(), session)
    print(f'Result:\n    {_yaml(result.result)}')
    print(f'Goal finished with status: {_STATUS.get(result.status, "UNKNOWN")}')


def _result_of(future: Handle, session: Session) -> Handle:
    session.spin_until(future.done)
    if future.exception() is not None:
        raise FrontendError(f'Exception while sending goal: {future.exception()!r}')
    return future.result()


def _cancel(sent: Handle, session: Session) -> None:
    """Cancel the goal, even one that is still being sent and may be accepted later."""
    if not session.spin_until(sent.done, _CANCEL_TIMEOUT):
        raise FrontendError('Failed to cancel goal: it is not known whether it was accepted')
    if sent.exception() is not None or not sent.result().accepted:
        return
    print('Canceling goal...')
    future = sent.result().cancel_goal_async()
    if not session.spin_until(future.done, _CANCEL_TIMEOUT):
        raise FrontendError('Failed to cancel goal: no answer')
    if not future.result().goals_canceling:
        raise FrontendError('Failed to cancel goal')
    print('Goal canceled.')


def _print_feedback(message: Message) -> None:
    print(f'Feedback:\n    {_yaml(message.feedback)}')


def _yaml(message: Message) -> str:
    return to_yaml(to_document(message))
