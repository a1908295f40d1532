# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_hardware replay``: publishes a serial log as hardware_node's topics."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
import sys
import threading
import time

from rclpy.node import Node

from black_box import LogPlayer, PlaybackError
from node_runner import (
    destroyed_if_refused,
    discover_other_nodes,
    give_defaults,
    log_as,
    notify_ready,
    other_nodes,
    ParameterReader,
    refuse_misspelt,
    run_program,
    spin_beside,
)
from quad_description import RobotState
from robot_primitives import setting, settings_of, switch

from ..backend import ReplayedRobot
from ..calibration.main import read_parameters
from ..exceptions import HardwareError, RecordingError
from ..link import LinkOptions, LinkState
from ..recording import Entry, read_serial_log
from .parameters import declare_frames, declare_robot, Deviations
from .robot_topics import log_link, RobotTopics, WARN_PERIOD

RECORDED = 'hardware_node'  # whose topics these are
CALIBRATED = ('joints', 'imu', 'odometry')  # parameters of hardware_node that belong to a robot
WATCH_PERIOD = 0.5  # [s] between two looks for a hardware_node


@dataclass(frozen=True, slots=True)
class ReplaySettings:
    """Parameters of the replay."""

    log: str = switch('', 'file of a black box, or of serial_log of hardware_node (required)')
    rate: float = setting(1.0, 0.01, 100.0, 'how many seconds of the log go by in one')
    start: float = setting(0.0, 0.0, 1e6, 'where it begins, after the first entry [s]')
    loop: bool = switch(False, 'begin again at the end')
    calibration: str = switch('', 'YAML file that quad_hardware calibrate has made')
    diagnostics_period: float = setting(
        1.0, 0.05, 60.0, 'time between two /diagnostics messages [s]'
    )


ROWS = [
    f'  {name:<20}{meaning}' + (f' (default {default})' if default else '')
    for name, default, _, meaning in settings_of(ReplaySettings)
]
HELP = f"""\
Publish what hardware_node had published while a log of its serial line was recorded; nothing is
written to a port, and the robot of a log takes no commands.

usage: ros2 run quad_hardware replay --ros-args -p log:=FILE [-p NAME:=VALUE ...]

example:
  ros2 run quad_hardware replay --ros-args -p log:=serial.log -p rate:=0.2 -p start:=40.0

parameters:
{chr(10).join(ROWS)}

Those of hardware_node for the robot, its frames and its estimation are there, too:
robot_description, preset, arm, joints.*, imu.*, odometry.*, odom_frame, publish_tf ...
"""


class Replay:
    """Node that replays a serial log."""

    def __init__(self, node: Node) -> None:
        """Read the parameters.

        Raises:
            ParameterError: A parameter is misspelt, of the wrong type or out of range.
            HardwareError: The log is missing, or parameters do not match the robot.
        """
        self._refusal: Exception | None = None
        self._node = node
        read = ParameterReader(node)
        self._settings = settings = read.settings(ReplaySettings)
        self._log = Path(settings.log).expanduser()
        if settings.calibration:
            give_defaults(node, dict(_calibrated(Path(settings.calibration).expanduser())))
        self._robot = robot = ReplayedRobot(declare_robot(read, LinkOptions(settings.log)))
        robot.on_state, robot.on_change = self._publish, self._log_change
        robot.on_refusal = self._log_refusal
        frames, deviations = declare_frames(read), read.settings(Deviations)
        refuse_misspelt(node)
        if not settings.log:
            raise RecordingError('give a log: --ros-args -p log:=FILE')
        if not self._log.is_file():
            raise RecordingError(f'{self._log}: there is no such file')
        self._player: LogPlayer[Entry] = LogPlayer(
            self._robot,
            lambda: ((entry.time, entry) for entry in read_serial_log(self._log)),
            name=str(self._log),
            rate=settings.rate,
            start=settings.start,
        )
        self._player.on_tick = self._tick
        self._topics = RobotTopics(node, self._robot, frames, deviations, self._player.steady)
        self._diagnostics_due = 0.0

    def play(self, stop: threading.Event) -> None:
        """Play the log in its own thread while the node spins.

        Args:
            stop: Ends the replay; set at the end of the log.

        Raises:
            HardwareError: Another node publishes the same topics meanwhile.
            PlaybackError: The log cannot be played to its end.
        """
        self._node.create_timer(WATCH_PERIOD, partial(self._look_for_robot, stop))
        spin_beside(partial(self._run, stop), [self._node], stop, 'replay')
        if self._refusal is not None:
            raise self._refusal

    def _run(self, stop: threading.Event) -> None:
        notify_ready()
        self._node.get_logger().info(f'replay of {self._log}')
        self._player.play(stop, loop=self._settings.loop)
        self._node.get_logger().info(f'{self._log.name}: end of the log')

    def _look_for_robot(self, stop: threading.Event) -> None:
        if found := other_nodes(self._node, _published_by(self._node), _own(self._node)):
            self._refusal = _refusal(found)
            stop.set()

    def _publish(self, state: RobotState) -> None:
        if not self._player.seeking:
            self._topics.publish(state)

    def _log_change(self, state: LinkState, detail: str) -> None:
        if not self._player.seeking:
            log_link(self._node, state, detail)

    def _log_refusal(self, reason: str) -> None:
        if not self._player.seeking:
            self._node.get_logger().warning(
                f'report refused: {reason}', throttle_duration_sec=WARN_PERIOD
            )

    def _tick(self) -> None:
        now = time.monotonic()
        if now >= self._diagnostics_due:
            self._diagnostics_due = now + self._settings.diagnostics_period
            log = str(self._log)
            self._topics.publish_diagnostics(
                RECORDED, self._log.name, lambda subject: '' if subject else log
            )


def main() -> int:
    """Run until the end of the log or Ctrl-C; return the exit code."""
    return run_program('replay', _serve, HardwareError, PlaybackError, OSError, help_text=HELP)


def _serve(stop: threading.Event) -> None:
    node = Node('replay')
    with destroyed_if_refused(node):
        log_as(node)
        replay = Replay(node)
        if found := discover_other_nodes(node, _published_by(node), _own(node), stop):
            raise _refusal(found)
    try:
        if not stop.is_set():
            replay.play(stop)
    finally:
        node.destroy_node()


def _own(node: Node) -> list[str]:
    return [str(node.get_fully_qualified_name())]


def _published_by(node: Node) -> set[str]:
    """Return other nodes that publish the same topics."""
    return {f'{node.get_namespace().rstrip("/")}/{RECORDED}', *_own(node)}


def _refusal(found: list[str]) -> RecordingError:
    return RecordingError(
        f'{found[0]} runs already, so topics would have messages of both: end it, or replay into '
        'a namespace of its own by -r __ns:=/replay'
    )


def _calibrated(path: Path) -> Iterator[tuple[str, object]]:
    """Yield the robot calibration in a file, by parameter name."""
    if not path.is_file():
        raise RecordingError(f'calibration: {path}: there is no such file')
    tree = read_parameters(path)
    yield from _flat({name: tree[name] for name in CALIBRATED if name in tree}, '')
    yield from ((n, v) for n, v in tree.items() if n.partition('.')[0] in CALIBRATED and '.' in n)


def _flat(tree: object, name: str) -> Iterator[tuple[str, object]]:
    if not isinstance(tree, dict):
        yield name, tree
        return
    for key, value in tree.items():
        yield from _flat(value, f'{name}.{key}' if name else str(key))


if __name__ == '__main__':
    sys.exit(main())
