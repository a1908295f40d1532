# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_canopen replay``: republishes the topics of a master from a log of its bus."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
import sys
import threading
import time

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node

from black_box import LogPlayer, PlaybackError
from canopen_core import CanopenError
from canopen_core.can import read_log
from node_runner import (
    discover_other_nodes,
    log_as,
    notify_ready,
    other_nodes,
    ParameterReader,
    refuse_misspelt,
    run_program,
    spin_beside,
)

from ..config import load_bus
from ..config.model import BusConfig
from ..master.events import Event
from ..recording import BusReplay, unknown_scales
from .device_node import DeviceTopics, log_bus_event, node_options
from .diagnostics import bus_diagnostics, DiagnosticsPublisher
from .joint_state_publisher import BusJointStates, DriveJointStates
from .output_thread import OutputThread

MASTER = 'master'
WATCH_PERIOD = 0.5  # [s] between two looks for a master
LISTENER_PERIOD = 0.1  # [s] in which a new subscriber gets its first message
RATES = (0.01, 100.0)
HELP = """\
Publish what a master had published while a log of its bus was recorded; nothing is sent on a bus.

usage: ros2 run arm_canopen replay --ros-args -p log:=FILE -p bus_config:=FILE [-p NAME:=VALUE ...]

example:
  ros2 run arm_canopen replay --ros-args -p bus_config:=bus.yml -p log:=can.log -p rate:=0.2

parameters:
  log                 file of a black box or of candump, ASC, BLF, TRC or csv (required)
  interface           of a log of several buses: the one to play, as the log names it
  bus_config          the bus.yml of that bus (required)
  rate                how many seconds of the log go by in one (default 1.0)
  start               where it begins, in [s] after the first frame (default 0.0)
  loop                begin again at the end (default false)
  robot_joint_states  publish the joints of all drives as /joint_states (default false)
  robot_description   URDF as XML text, for /joint_states (default: the topic robot_description)
  diagnostics_period  time between two /diagnostics messages in [s] (default 1.0)
"""


@dataclass(frozen=True, slots=True)
class Parameters:
    """Parameters of the program; :data:`HELP` describes them."""

    log: Path
    interface: str
    bus_config: str
    rate: float
    start: float
    loop: bool
    robot_joint_states: bool
    robot_description: str
    diagnostics_period: float


def main() -> int:
    """Run until the end of the log or Ctrl-C; return the exit code."""
    return run_program('replay', _serve, CanopenError, PlaybackError, OSError, help_text=HELP)


class ReplayProcess:
    """Nodes of a replayed bus."""

    def __init__(
        self, node: Node, config: BusConfig, parameters: Parameters, stack: ExitStack
    ) -> None:
        self._refusal: Exception | None = None
        self._node = node
        self._parameters = parameters
        self._name = parameters.log.name
        self._output = OutputThread(node.get_logger())
        self._bus = bus = BusReplay(config, self._report)
        self._player = LogPlayer(
            bus,
            lambda: (
                (frame.timestamp, frame)
                for frame in read_log(parameters.log, parameters.interface)
            ),
            name=str(parameters.log),
            rate=parameters.rate,
            start=parameters.start,
        )
        self._player.on_tick = self._tick
        self.nodes = [node]  # the nodes, for the executor
        self._topics: dict[str, DeviceTopics] = {}
        drives = []
        for device in bus.network.nodes.values():
            own = Node(device.name, **node_options(device.config))
            stack.callback(own.destroy_node)
            self.nodes.append(own)
            self._topics[device.name] = DeviceTopics(own, device, self._output)
            if device.name in bus.axes:
                drives.append(DriveJointStates(own, [axis.view for axis in bus.axes[device.name]]))
        self._joint_states = BusJointStates(node, drives, self._output)
        if parameters.robot_joint_states:
            self._joint_states.publish_robot(parameters.robot_description)
        bus.network.on_feedback = self._feedback
        self._diagnostics = DiagnosticsPublisher(node, self._output)
        self._diagnostics_due = 0.0
        node.create_timer(LISTENER_PERIOD, self._update_listeners)

    def play(self, stop: threading.Event) -> None:
        """Play the log in a separate thread, and spin the nodes meanwhile.

        Setting ``stop`` ends the replay; the end of the log sets it, too.

        Raises:
            CanopenError: Another node publishes the same topics meanwhile.
            PlaybackError: The log cannot be played to its end.
        """
        self._node.create_timer(WATCH_PERIOD, partial(self._look_for_master, stop))
        self._output.start()
        try:
            spin_beside(partial(self._run, stop), self.nodes, stop, 'replay')
        finally:
            self._output.stop()
        if self._refusal is not None:
            raise self._refusal

    def _run(self, stop: threading.Event) -> None:
        notify_ready()
        self._player.play(stop, loop=self._parameters.loop)
        self._node.get_logger().info(f'{self._name}: end of the log')

    def _look_for_master(self, stop: threading.Event) -> None:
        own = [node.get_fully_qualified_name() for node in self.nodes]
        names = _published_by(self._node, self._bus.network.config)
        if found := other_nodes(self._node, names, own):
            self._refusal = _refusal(found)
            stop.set()

    def _report(self, event: Event) -> None:
        self._output.post_stream((event.kind, event.node), partial(self._take_event, event))
        if not self._player.seeking:
            log = partial(log_bus_event, self._node, event)
            self._output.post_stream(('log', event.kind, event.node), log)

    def _take_event(self, event: Event) -> None:
        if event.node in self._topics:
            self._topics[event.node].take_event(event)

    def _feedback(self, sync_time: float) -> None:
        if not self._player.seeking:
            self._joint_states.feedback(self._player.steady(sync_time))

    def _tick(self) -> None:
        now = time.monotonic()
        if now >= self._diagnostics_due:
            self._diagnostics_due = now + self._parameters.diagnostics_period
            self._diagnostics.post(self._collect())

    def _collect(self) -> list[DiagnosticStatus]:
        bus, now = self._bus, self._bus.now
        path = str(self._parameters.log)
        return bus_diagnostics(
            MASTER,
            self._name,
            bus.network,
            {name: [axis.status() for axis in axes] for name, axes in bus.axes.items()},
            now,
            counters=bus.counters,
            load=bus.load.figures(now),
            cycle=bus.figures(),
            recording=lambda device: '' if device else path,
        )

    def _update_listeners(self) -> None:
        self._joint_states.update_listeners()
        for topics in self._topics.values():
            topics.update_listeners()


def _serve(stop: threading.Event) -> None:
    with ExitStack() as stack:
        first = Node('replay')
        try:
            config = load_bus(_declare(first).bus_config)
        finally:
            first.destroy_node()  # bus.yml says in which namespace it is
        node = Node('replay', namespace=config.master.namespace or None)
        stack.callback(node.destroy_node)
        log_as(node)
        parameters = _declare(node)
        for name in unknown_scales(config):
            node.get_logger().warning(
                f'{name}: its units are those of its factor group, which the master had read from '
                'the drive; here they are those of bus.yml without it. Write scale_pos_to_dev and '
                'scale_pos_from_dev into a copy of bus.yml'
            )
        own = [node.get_fully_qualified_name()]
        if found := discover_other_nodes(node, _published_by(node, config), own, stop):
            raise _refusal(found)
        if stop.is_set():
            return
        process = ReplayProcess(node, config, parameters, stack)
        node.get_logger().info(f'replay of {parameters.log} with {config.file}')
        process.play(stop)


def _published_by(node: Node, config: BusConfig) -> set[str]:
    """Return the nodes that publish the topics of a replay of this bus."""
    here = node.get_namespace().rstrip('/')
    # __ns of the command line goes before the namespaces of bus.yml
    moved = here != f'/{config.master.namespace.strip("/")}'.rstrip('/')
    names = {f'{here}/{MASTER}', node.get_fully_qualified_name()}
    for device in config.nodes:
        space = here if moved else f'/{device.namespace.strip("/")}'.rstrip('/')
        names.add(f'{space}/{device.name}')
    return names


def _refusal(found: Sequence[str]) -> CanopenError:
    return CanopenError(
        f'{found[0]} runs already, so topics would have messages of both: end it, or replay into '
        'a namespace of its own by -r __ns:=/replay'
    )


def _declare(node: Node) -> Parameters:
    read = ParameterReader(node)
    log = read.text('log', '', 'log of a bus: black box, candump, ASC, BLF, TRC or csv')
    parameters = Parameters(
        log=Path(log),
        interface=read.text(
            'interface', '', 'of a log of several buses: the one to play, as the log names it'
        ),
        bus_config=read.text('bus_config', '', 'the bus.yml of that bus'),
        rate=read.number('rate', 1.0, RATES, 'how many seconds of the log go by in one'),
        start=read.number('start', 0.0, (0.0, 1e6), 'where it begins, after the first frame [s]'),
        loop=read.flag('loop', 'begin again at the end', default=False),
        robot_joint_states=read.flag(
            'robot_joint_states', 'publish the joints of all drives as joint_states', default=False
        ),
        robot_description=read.text(
            'robot_description',
            '',
            'URDF as XML text, for joint_states; without it, the topic robot_description',
        ),
        diagnostics_period=read.number(
            'diagnostics_period', 1.0, (0.05, 60.0), 'time between two /diagnostics messages [s]'
        ),
    )
    refuse_misspelt(node)
    if not log or not parameters.bus_config:
        raise CanopenError(
            'give a log and its bus.yml: --ros-args -p log:=FILE -p bus_config:=FILE'
        )
    if not parameters.log.is_file():
        raise CanopenError(f'{log}: there is no such file')
    return parameters


if __name__ == '__main__':
    sys.exit(main())
