# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The services and the topic by which ``ros2 lifecycle`` and managers handle a managed entity."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import Future
from functools import partial
from typing import Any

from lifecycle_msgs.msg import State, TransitionDescription, TransitionEvent
from lifecycle_msgs.msg import Transition as TransitionMessage
from lifecycle_msgs.srv import (
    ChangeState,
    GetAvailableStates,
    GetAvailableTransitions,
    GetState,
)
from rclpy.node import Node

from node_runner import create_deferred_service

from ..master.lifecycle import LifecycleState, Managed, Transition, TRANSITIONS
from ..master.runner import NetworkThread
from .output_thread import OutputThread


class LifecycleServices:
    """What makes a node a managed one."""

    def __init__(
        self, node: Node, managed: Managed, thread: NetworkThread, output: OutputThread
    ) -> None:
        self._node = node
        self._managed = managed
        self._thread = thread
        self._output = output
        self._events = node.create_publisher(TransitionEvent, '~/transition_event', 10)
        managed.on_change = self._changed
        create_deferred_service(
            node, ChangeState, '~/change_state', self._change, self._answer, post=output.post
        )
        node.create_service(GetState, '~/get_state', self._get_state)
        node.create_service(GetAvailableStates, '~/get_available_states', self._get_states)
        node.create_service(
            GetAvailableTransitions, '~/get_available_transitions', self._get_transitions
        )
        node.create_service(
            GetAvailableTransitions, '~/get_transition_graph', self._get_transition_graph
        )

    def _change(self, request: ChangeState.Request) -> Future[None]:
        async def change() -> None:
            wanted = request.transition
            await self._managed.change(self._managed.find(wanted.id, wanted.label))

        return self._thread.run_coroutine(change)

    def _answer(
        self, response: ChangeState.Response, future: Future[None]
    ) -> ChangeState.Response:
        error = future.exception()
        response.success = error is None
        if error is not None:
            self._node.get_logger().warning(str(error))
        return response

    def _changed(
        self, transition: Transition, before: LifecycleState, after: LifecycleState, ended: bool
    ) -> None:
        # called in the thread of the network, which must not wait for DDS
        stamp = self._node.get_clock().now().nanoseconds
        self._output.post(partial(self._publish_event, transition, before, after, ended, stamp))

    def _publish_event(
        self,
        transition: Transition,
        before: LifecycleState,
        after: LifecycleState,
        ended: bool,
        stamp: int,
    ) -> None:
        number, label = transition.number, transition.verb.label
        if ended:
            failed = after is not transition.success
            number = 10 * transition.verb + failed
            label = 'transition_failure' if failed else 'transition_success'
            self._node.get_logger().info(after.label)
        self._events.publish(
            TransitionEvent(
                timestamp=stamp,
                transition=TransitionMessage(id=number, label=label),
                start_state=_state(before),
                goal_state=_state(after),
            )
        )

    def _get_state(self, _: Any, response: GetState.Response) -> GetState.Response:  # noqa: ANN401
        response.current_state = _state(self._managed.state)
        return response

    def _get_states(self, _: Any, response: Any) -> Any:  # noqa: ANN401
        response.available_states = [_state(state) for state in LifecycleState]
        return response

    def _get_transitions(self, _: Any, response: Any) -> Any:  # noqa: ANN401
        response.available_transitions = _descriptions(self._managed.possible)
        return response

    def _get_transition_graph(self, _: Any, response: Any) -> Any:  # noqa: ANN401
        response.available_transitions = _descriptions(TRANSITIONS)
        return response


def _state(state: LifecycleState) -> State:
    return State(id=int(state), label=state.label)


def _descriptions(transitions: Iterable[Transition]) -> list[TransitionDescription]:
    return [
        TransitionDescription(
            transition=TransitionMessage(id=entry.number, label=entry.verb.label),
            start_state=_state(entry.start),
            goal_state=_state(entry.success),
        )
        for entry in transitions
    ]
