# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One bus in one process: network, drives and all their ROS nodes.

The master's node offers SDO and NMT for any node id, and the service ``stop``, which stops the
robot, whatever moves it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future, wait
from functools import partial
import threading
import time
from typing import Any

from canopen_interfaces.srv import CONmtID, COReadID, COWriteID
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Trigger

from black_box import BlackBoxSettings
from canopen_core import CanopenError
from canopen_core.can import Bus
from canopen_core.standard import (
    ALL_NODES,
    byte_length,
    DataType,
    NmtCommand,
    NODE_ID_MAX,
    NODE_ID_MIN,
    object_address,
)
from node_runner import create_deferred_service, notify_ready, raise_thread_priority

from ..canopen_master import CanopenMaster
from ..cia402.commands import AxisCommands
from ..cia402.motion import MotionSource
from ..cia402.motion_group import stop_all, StopReport
from ..config.model import BusConfig
from ..master.events import Event
from ..master.runner import NetworkThread
from ..master.scheduler import Promise
from .axis_services import offer_drive
from .device_node import (
    answer_read,
    answer_success,
    bytes_from_raw,
    DeviceNode,
    log_bus_event,
    raw_from_bytes,
)
from .diagnostics import bus_diagnostics, DiagnosticsPublisher
from .io_topics import EncoderTopics, offer_io
from .joint_state_publisher import BusJointStates
from .lifecycle import manage_bus
from .output_thread import OutputThread

SERVICE_TYPES = (
    DataType.INTEGER8,
    DataType.INTEGER16,
    DataType.INTEGER32,
    DataType.UNSIGNED8,
    DataType.UNSIGNED16,
    DataType.UNSIGNED32,
)
"""Data types that COReadID and COWriteID name."""

SERVICE = 'stop'
EVENT_TOPIC, STOP_EVENT = 'trajectory_execution_event', 'stop'
"""Topic and message that make MoveIt's move_group, or ours, drop running and queued executions."""
SDO_TIMEOUT = 0.5  # [s] a stranger's bus.yml entry, which would say, does not exist


class MasterServices:
    """Services of the master node; ``stop`` is always available, even while devices boot."""

    def __init__(
        self,
        node: Node,
        commands: Sequence[AxisCommands],
        thread: NetworkThread,
        output: OutputThread,
    ) -> None:
        # called for every other request; raises CanopenError when none is taken at the moment
        self.admit: Callable[[], None] = lambda: None
        self._node, self._commands, self._thread = node, commands, thread
        self._events = node.create_publisher(String, EVENT_TOPIC, 10)
        post = output.post
        create_deferred_service(node, Trigger, SERVICE, self._stop, self._answer_stop, post=post)
        for kind, name, begin, respond in (
            (COReadID, '~/sdo_read', self._read, answer_read),
            (COWriteID, '~/sdo_write', self._write, answer_success),
            (CONmtID, '~/set_nmt', self._set_nmt, answer_success),
        ):
            fill = partial(respond, node)
            create_deferred_service(node, kind, name, begin, fill, post=post)

    def _read(self, request: COReadID.Request) -> Future[int]:
        async def read() -> int:
            self.admit()
            data_type = _data_type(request.canopen_datatype)
            client = self._thread.network.sdo_client(_node_id(request.nodeid))
            data = await client.read(request.index, request.subindex, SDO_TIMEOUT)
            if len(data) != byte_length(data_type):
                raise CanopenError(
                    f'{object_address(request.index, request.subindex)} of node {request.nodeid} '
                    f'has {len(data)} bytes, {data_type.name} has {byte_length(data_type)}'
                )
            return raw_from_bytes(data)

        return self._thread.run_coroutine(read)

    def _write(self, request: COWriteID.Request) -> Future[None]:
        def write() -> Promise[None]:
            self.admit()
            for device in self._thread.network.nodes.values():
                if device.config.node_id == request.nodeid:
                    device.objects.check_owner(request.index)
            data = bytes_from_raw(_data_type(request.canopen_datatype), request.data)
            client = self._thread.network.sdo_client(_node_id(request.nodeid))
            return client.write(request.index, request.subindex, data, SDO_TIMEOUT)

        return self._thread.run(write)

    def _set_nmt(self, request: CONmtID.Request) -> Future[None]:
        async def send() -> None:
            self.admit()
            node_id = request.nodeid if request.nodeid == ALL_NODES else _node_id(request.nodeid)
            await self._thread.network.command_nmt(_nmt_command(request.nmtcommand), node_id)

        return self._thread.run_coroutine(send)

    def _stop(self, _: Trigger.Request) -> Future[StopReport]:
        """Halt all drives of the bus."""
        self._events.publish(String(data=STOP_EVENT))  # or a plan would begin after the halt
        scheduler = self._thread.network.scheduler
        return self._thread.run_coroutine(lambda: stop_all(self._commands, scheduler))

    def _answer_stop(self, response: Any, future: Future[StopReport]) -> Any:  # noqa: ANN401
        error = future.exception()
        if error is None:
            report = future.result()
            response.success, response.message = not report.failed, str(report)
        else:
            response.success, response.message = False, str(error)
        words = f'{SERVICE}: {response.message}'
        # a line of its own for each severity: rclpy refuses another one from the same line
        if response.success:
            self._node.get_logger().info(words)
        else:
            self._node.get_logger().error(words)
        return response


def _data_type(number: int) -> DataType:
    for data_type in SERVICE_TYPES:
        if data_type == number:
            return data_type
    names = ', '.join(f'{data_type.name} {data_type:#04x}' for data_type in SERVICE_TYPES)
    raise CanopenError(f'canopen_datatype {number:#04x} is none of {names}')


def _nmt_command(number: int) -> NmtCommand:
    try:
        return NmtCommand(number)
    except ValueError:
        names = ', '.join(f'{command.value} {command.name}' for command in NmtCommand)
        raise CanopenError(f'nmtcommand {number} is none of {names}') from None


def _node_id(number: int) -> int:
    if not NODE_ID_MIN <= number <= NODE_ID_MAX:
        raise CanopenError(f'node id {number} is not {NODE_ID_MIN} to {NODE_ID_MAX}')
    return number


LISTENER_PERIOD = 0.1  # [s] in which a new subscriber gets its first message
LAST_DIAGNOSTICS_TIMEOUT = 0.5  # [s] for the last /diagnostics


class MasterProcess:
    """Everything that ``ros2 run arm_canopen master`` runs."""

    def __init__(
        self,
        node: Node,
        config: BusConfig,
        can: Bus,
        *,
        diagnostics_period: float,
        thread_priority: int = 0,
        beside_master: bool = False,
        black_box: BlackBoxSettings | None = None,
    ) -> None:
        """Prepare without sending; the caller has opened ``can`` and closes it.

        The ``diagnostics_period`` is in [s].
        """
        self.bus = config  # the configuration of the bus
        self._node = node
        self._output = OutputThread(node.get_logger())
        self._thread_priority = thread_priority
        self._master = CanopenMaster(
            config, can, on_event=self._report, beside_master=beside_master, black_box=black_box
        )
        self._master.on_operational = lambda: self._output.post(self._report_ready)
        self._network, self._thread = self._master.network, self._master.thread
        self._thread.refuse_before_start('')  # what is handed over before waits for the start
        self._devices = {
            device.name: DeviceNode(device, self._thread, self._output)
            for device in self._network.nodes.values()
        }
        file = config.file.absolute()
        self._axes = {
            name: self._master.axes(each.device)
            for name, each in self._devices.items()
            if each.device.config.is_drive
        }
        drives = [
            offer_drive(self._devices[name], axes, self._thread, file)
            for name, axes in self._axes.items()
        ]
        self._io = {
            name: io
            for name, each in self._devices.items()
            if (io := offer_io(each, self._thread)) is not None
        }
        drives += [io.joint_states for io in self._io.values() if isinstance(io, EncoderTopics)]
        self._joint_states = BusJointStates(node, drives, self._output)
        self._network.on_feedback = self._joint_states.feedback
        commands = list(self._master.commands.values())
        services = MasterServices(node, commands, self._thread, self._output)
        self._diagnostics = DiagnosticsPublisher(node, self._output)
        node.create_timer(diagnostics_period, self._request_diagnostics)
        node.create_timer(LISTENER_PERIOD, self._update_listeners)
        # the ROS nodes, the master's first
        self.nodes: list[Node] = [node, *self._devices.values()]
        if config.master.is_lifecycle:
            manager, services.admit = manage_bus(
                node, self._devices, self._master.axes, self._thread, self._output
            )
            self.nodes.append(manager)

    def listen(self) -> None:
        """Listen for another master before the first frame; call it right before :meth:`start`.

        Raises:
            OtherMasterError: Another master was found or cannot be ruled out, and beside_master is
                not set.
        """
        if other := self._master.listen():
            self._node.get_logger().warning(f'beside_master is set; starting anyway: {other}')

    def start(self) -> None:
        """Boot the devices and start the cycle."""
        self._output.start()
        what, priority = 'the CANopen cycle', self._thread_priority
        self._master.start(lambda: raise_thread_priority(self._node, priority, what))

    def end_on_failure(self, stop: threading.Event) -> None:
        """Set ``stop`` when a defect ends the cycle; call it before :meth:`start`."""
        self._thread.on_failure = stop.set

    @property
    def failure(self) -> CanopenError | None:
        """Error of the defect that ended the cycle; None without one."""
        return self._thread.failure

    def stop(self) -> None:
        """Bring every drive to quick stop and disable it, then end the cycle."""
        if not self._master.started:
            return  # the devices are not ours
        try:
            self._master.stop_drives()
        except CanopenError as error:
            self._node.get_logger().error(str(error))
        finally:
            last = self._request_diagnostics()  # in which states the drives are left
            wait([last], LAST_DIAGNOSTICS_TIMEOUT)
            self._master.end()
            self._output.stop()

    def publish_robot_joint_states(self, description: str) -> None:
        """Also publish ``joint_states`` of all drives of the bus; call it before :meth:`start`.

        Joint order and mimic joints come from a URDF in XML or the topic ``robot_description``.
        """
        self._joint_states.publish_robot(description)

    def attach(self, source: MotionSource) -> Future[None]:
        """Attach a motion source; see :meth:`.CanopenMaster.begin_attach`."""
        return self._master.begin_attach(source)

    def detach(self, source: MotionSource) -> Future[None]:
        """Detach a motion source; see :meth:`.CanopenMaster.begin_detach`."""
        return self._master.begin_detach(source)

    def _report(self, event: Event) -> None:
        self._output.post_stream((event.kind, event.node), partial(self._log_event, event))

    def _collect(self) -> list[DiagnosticStatus]:
        now = time.monotonic()
        can = self._master.can
        return bus_diagnostics(
            self._node.get_name(),
            can.name,
            self._network,
            {name: [each.axis.status() for each in axes] for name, axes in self._axes.items()},
            now,
            counters=can.counters,
            load=self._master.load.figures(now),
            cycle=self._thread.figures(),
            recording=self._recording,
            io={name: each.diagnostics() for name, each in self._io.items()},
        )

    def _recording(self, device: str) -> str:
        """Return the latest black-box file of a device, or of any; empty without one."""
        box = self._master.black_box
        path = None if box is None else box.recording_of(device) if device else box.last
        return '' if path is None else str(path)

    def _log_event(self, event: Event) -> None:
        log_bus_event(self._node, event)
        node = self._devices.get(event.node)
        if node is not None:
            node.topics.take_event(event)

    def _report_ready(self) -> None:
        self._node.get_logger().info(f'all {len(self.bus.nodes)} devices operational')
        notify_ready()

    def _request_diagnostics(self) -> Future[list[DiagnosticStatus]]:
        future = self._thread.call(self._collect)
        future.add_done_callback(self._post_diagnostics)
        return future

    def _post_diagnostics(self, future: Future[list[DiagnosticStatus]]) -> None:
        if future.exception() is None:  # else the network has ended
            self._diagnostics.post(future.result())

    def _update_listeners(self) -> None:
        self._joint_states.update_listeners()
        for node in self._devices.values():
            node.topics.update_listeners()
