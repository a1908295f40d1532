# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Lifecycle nodes of a bus whose bus.yml names lifecycle drivers, and their manager."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Future
from functools import partial
from typing import Any

from lifecycle_msgs.msg import State, TransitionDescription, TransitionEvent
from lifecycle_msgs.msg import Transition as TransitionMessage
from lifecycle_msgs.srv import ChangeState, GetAvailableStates, GetAvailableTransitions, GetState
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node

from canopen_core import BootError
from node_runner import create_deferred_service

from ..cia402.commands import AxisCommands
from ..master.lifecycle import (
    LifecycleState,
    Managed,
    MANAGER,
    Supervisor,
    Transition,
    TRANSITIONS,
    Verb,
    Work,
)
from ..master.remote_node import RemoteNode
from ..master.runner import NetworkThread
from .device_node import answer_success, DeviceNode
from .output_thread import OutputThread

BOOT_ATTEMPTS = 3  # boot time-outs that an activation waits, as ros2_canopen does


class ManagedBus:
    """The lifecycle of a master and its devices.

    A device that is not active takes no commands. Deactivating a drive stops and disables it.
    """

    def __init__(
        self,
        node: Node,
        devices: Mapping[str, DeviceNode],
        axes: Callable[[RemoteNode], Sequence[AxisCommands]],
        thread: NetworkThread,
        output: OutputThread,
    ) -> None:
        self._scheduler = thread.network.scheduler
        master = Managed(node.get_name(), _nothing)
        self.admit = master.require_active  # lets a request to the master pass
        LifecycleServices(node, master, thread, output)
        managed = []
        for name, device in devices.items():
            entry = Managed(name, self._work(device.device, axes(device.device)))
            device.admit = entry.require_active
            LifecycleServices(device, entry, thread, output)
            managed.append(entry)
        supervisor = Supervisor(master, managed, self._scheduler)
        # the node ``lifecycle_manager``, in the namespace of the master
        self.manager = Node(MANAGER, namespace=node.get_namespace())
        text = ParameterDescriptor(
            description='accepted for ros2_canopen; not needed', read_only=True
        )
        self.manager.declare_parameter('container_name', '', text)
        LifecycleServices(self.manager, Managed(MANAGER, supervisor.work), thread, output)

    def _work(self, device: RemoteNode, axes: Sequence[AxisCommands]) -> Work:
        async def work(verb: Verb) -> None:
            if verb is Verb.ACTIVATE:
                await self._booted(device)
            elif verb in (Verb.DEACTIVATE, Verb.SHUTDOWN):
                await self._scheduler.gather([axis.request('shutdown') for axis in axes])

        return work

    async def _booted(self, device: RemoteNode) -> None:
        timeout = BOOT_ATTEMPTS * device.config.boot_timeout
        try:
            await self._scheduler.until(lambda: device.online, timeout)
        except TimeoutError:
            raise BootError(
                f'{device.name} is not activated: not booted within {timeout:g} s '
                f'({device.phase.value} {device.phase_detail})'.rstrip()
            ) from None


async def _nothing(verb: Verb) -> None:
    """Do no work: the master boots and watches its devices in every state."""


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
            node,
            ChangeState,
            '~/change_state',
            self._change,
            partial(answer_success, node),
            post=output.post,
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
