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
)
from ..master.remote_node import RemoteNode
from ..master.runner import NetworkThread
from ..master.scheduler import Scheduler
from .device_node import answer_success, DeviceNode
from .output_thread import OutputThread

BOOT_ATTEMPTS = 3  # boot time-outs that an activation waits, as ros2_canopen does


def manage_bus(
    node: Node,
    devices: Mapping[str, DeviceNode],
    axes: Callable[[RemoteNode], Sequence[AxisCommands]],
    thread: NetworkThread,
    output: OutputThread,
) -> tuple[Node, Callable[[], None]]:
    """Create the lifecycle services of a master and its devices.

    A device that is not active rejects commands. Deactivating a drive stops and disables it.

    Returns:
        The node ``lifecycle_manager``, in the namespace of the master, and the check that every
        request to the master must pass.
    """
    master = Managed(node.get_name(), _nothing)
    LifecycleServices(node, master, thread, output)
    managed = []
    for name, device in devices.items():
        work = partial(_work, device.device, axes(device.device), thread.network.scheduler)
        entry = Managed(name, work)
        device.admit = entry.require_active
        LifecycleServices(device, entry, thread, output)
        managed.append(entry)
    supervisor = Supervisor(master, managed, thread.network.scheduler)
    manager = Node(MANAGER, namespace=node.get_namespace())
    text = ParameterDescriptor(description='accepted for ros2_canopen; not needed', read_only=True)
    manager.declare_parameter('container_name', '', text)
    LifecycleServices(manager, Managed(MANAGER, supervisor.work), thread, output)
    return manager, master.require_active


async def _work(
    device: RemoteNode, axes: Sequence[AxisCommands], scheduler: Scheduler, verb: Verb
) -> None:
    if verb in (Verb.DEACTIVATE, Verb.SHUTDOWN):
        await scheduler.gather([axis.request('shutdown') for axis in axes])
    if verb is not Verb.ACTIVATE:
        return
    timeout = BOOT_ATTEMPTS * device.config.boot_timeout
    try:
        await scheduler.until(lambda: device.online, timeout)
    except TimeoutError:
        raise BootError(
            f'{device.name} is not activated: not booted within {timeout:g} s '
            f'({device.phase_text})'
        ) from None


async def _nothing(verb: Verb) -> None:
    """Do no work: the master boots and watches its devices in every state."""


class LifecycleServices:
    """Lifecycle services of a managed node."""

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
        states, transitions = 'available_states', 'available_transitions'
        graph = _descriptions(TRANSITIONS)
        for kind, name, field, value in (
            (GetState, 'get_state', 'current_state', lambda: _state(managed.state)),
            (GetAvailableStates, f'get_{states}', states, lambda: [*map(_state, LifecycleState)]),
            (GetAvailableTransitions, f'get_{transitions}', transitions, self._possible),
            (GetAvailableTransitions, 'get_transition_graph', transitions, lambda: graph),
        ):
            node.create_service(kind, f'~/{name}', partial(_answer, field, value))

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

    def _possible(self) -> list[TransitionDescription]:
        return _descriptions(self._managed.possible)


def _answer(field: str, value: Callable[[], Any], _: Any, response: Any) -> Any:  # noqa: ANN401
    setattr(response, field, value())
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
