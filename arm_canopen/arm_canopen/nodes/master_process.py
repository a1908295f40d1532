# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One bus in one process: network, drives and all their ROS nodes."""

from __future__ import annotations

from concurrent.futures import Future, wait
from functools import partial
import threading
import time

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node

from black_box import BlackBoxSettings
from canopen_core import CanopenError
from canopen_core.can import Bus
from node_runner import notify_ready, raise_thread_priority

from ..cia402.motion import MotionSource
from ..config.model import BusConfig
from ..library.canopen_master import CanopenMaster
from ..master.events import Event
from .axis_services import offer_drive
from .device_node import DeviceNode
from .device_topics import log_bus_event
from .diagnostics import bus_diagnostics, DiagnosticsPublisher
from .io_topics import EncoderTopics, offer_io
from .joint_states import BusJointStates
from .managed_bus import ManagedBus
from .master_node import MasterServices
from .output_thread import OutputThread
from .stop_service import StopService
from .units_service import BusFile

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
        """Nothing is sent before :meth:`start`; the bus is open, and stays the caller's to close.

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
        file = BusFile.at(config.file)
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
        services = MasterServices(node, self._thread, self._output)
        commands = list(self._master.commands.values())
        StopService(node, commands, self._thread, self._output)
        self._diagnostics = DiagnosticsPublisher(node, self._output)
        node.create_timer(diagnostics_period, self._request_diagnostics)
        node.create_timer(LISTENER_PERIOD, self._update_listeners)
        # the ROS nodes, the master's first
        self.nodes: list[Node] = [node, *self._devices.values()]
        if config.master.is_lifecycle:
            managed = ManagedBus(
                node, self._devices, self._master.axes, self._thread, self._output
            )
            services.admit = managed.admit
            self.nodes.append(managed.manager)

    def listen(self) -> None:
        """Listen for another master before the first frame; call it right before :meth:`start`.

        Raises:
            OtherMasterError: There is one, or that is not known, and beside_master is not set.
        """
        if other := self._master.listen():
            self._node.get_logger().warning(f'beside_master is set; starting anyway: {other}')

    def start(self) -> None:
        """Boot the devices and start the cycle."""
        self._output.start()
        what, priority = 'the CANopen cycle', self._thread_priority
        self._master.start(lambda: raise_thread_priority(self._node, priority, what))

    def end_on_failure(self, stop: threading.Event) -> None:
        """Set ``stop`` when a defect has ended the cycle; call it before :meth:`start`."""
        self._thread.on_failure = stop.set

    @property
    def failure(self) -> CanopenError | None:
        """The defect that has ended the cycle, if any."""
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
        """Publish ``joint_states`` of all drives of the bus, too; call it before :meth:`start`.

        Order, and which joints mimic others, by a URDF in XML, or the topic ``robot_description``.
        """
        self._joint_states.publish_robot(description)

    def attach(self, source: MotionSource) -> Future[None]:
        """Attach a motion source from any thread, without waiting.

        Returns:
            Done before the next cycle; or KeyError: an axis is no drive of this bus, BusError: the
            cycle has ended.
        """
        return self._master.begin_attach(source)

    def detach(self, source: MotionSource) -> Future[None]:
        """End a motion source, from any thread; drives that it moved are braked.

        Returns:
            Done before the next cycle.
        """
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
        """Return the last file of the black box, of a device or of any; empty before one."""
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
