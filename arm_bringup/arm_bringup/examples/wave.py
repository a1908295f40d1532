# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_bringup demo``: a simulated arm boots, is enabled and waves.

Every joint swings about the middle of its range, each a little later than the previous one. The
demo streams targets to the drives, as any client can. If another client stops or moves a drive,
the drive refuses the stream from then on.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
import itertools
import math
import os
import sys
import threading
import time

from std_msgs.msg import Float64
from urdf_reader import JointRange

from ..groups import moved_groups, MovedGroups
from ..robots import joint_limits, Robot, WaveError
from ..service_client import ServiceClient
from ..session import Session
from .arm import ArmDemo, known, number, parse, run

SWING_TIME = 5.0  # time of one swing in [s]
OMEGA = 2 * math.pi / SWING_TIME  # angular velocity of the wave in [rad/s]
AMPLITUDE, RANGE_SHARE = 0.45, 0.5
"""Greatest amplitude in [rad] or [m], and greatest share of a joint's range for the swing."""
VELOCITY_SHARE, MAX_VELOCITY = 0.6, 1.2
"""Greatest speed, as a share of a joint's limit, and in [rad/s] or [m/s]: drives approach targets
at most at that speed, and some URDFs have limits of thousands."""
SHORTEST_ENTRY = 2.0  # a joint takes at least this long to enter in [s]
PERIOD = 0.04  # time between two targets of a drive in [s]
LEAST_SHARE = 0.2  # a joint that moved less than this share of its amplitude did not wave
HALT_TIMEOUT = 10.0  # longest time in [s] for the drives to come to rest


def quintic_step(x: float) -> float:
    """Return a step from 0 at x <= 0 to 1 at x >= 1, twice differentiable, with slope <= 15/8."""
    x = min(max(x, 0.0), 1.0)
    return min(x * x * x * (10.0 + x * (6.0 * x - 15.0)), 1.0)  # rounding may pass 1


@dataclass
class Axis:
    """Swing of one drive, and statistics of its path error.

    Positions are in [rad] or [m], times on the steady clock in [s].
    """

    limits: JointRange  # range and speed of its joint
    phase: float  # how far it is ahead in [rad]
    centre: float = field(init=False)
    amplitude: float = field(init=False)
    velocity: float = field(init=False)  # greatest speed
    lowest: float = math.inf
    highest: float = -math.inf
    error_max: float = 0.0
    squares: float = 0.0  # sum of squared path errors
    samples: int = 0
    _start: float = math.nan
    _entered: float = math.nan
    _entry_time: float = SHORTEST_ENTRY

    def __post_init__(self) -> None:
        """Choose centre and amplitude within the limits; an unlimited joint swings about zero.

        Raises:
            WaveError: The joint has no room to move, or its speed limit is zero.
        """
        lower, upper, velocity = self.limits.lower, self.limits.upper, self.limits.velocity
        if not upper > lower or not velocity > 0:
            raise WaveError(
                f'joint {self.limits.name} cannot swing: its range is {lower:g} to {upper:g}, '
                f'its velocity limit {velocity:g}'
            )
        self.velocity = min(VELOCITY_SHARE * velocity, MAX_VELOCITY)
        half = (upper - lower) / 2
        self.amplitude = min(AMPLITUDE, RANGE_SHARE * half, 0.6 * self.velocity / OMEGA)
        self.centre = 0.0 if math.isinf(half) else (lower + upper) / 2

    @property
    def active(self) -> bool:
        """Whether the drive takes part in the wave."""
        return math.isfinite(self._start)

    def enter(self, position: float, now: float) -> None:
        """Start the wave from the given position."""
        way = abs(self.centre - position) + self.amplitude
        spare = self.velocity - self.amplitude * OMEGA
        self._entry_time = max(SHORTEST_ENTRY, way * 15 / 8 / spare)
        self._entered = now
        self._start = position  # the last one: the sender begins by it

    def target(self, now: float) -> float:
        """Return the target position at time ``now``.

        With the quintic step r and an entry of time T, p(t) = start + r(t/T) (centre +
        A sin(omega t + phase) - start) begins at rest, is twice continuously differentiable, and
        as a convex combination never leaves the hull of start and swing. With D = |centre - start|
        its speed is at most (D + A) 15/8/T + A omega; T is chosen so that this is the limit.
        """
        swing = self.centre + self.amplitude * math.sin(OMEGA * now + self.phase)
        share = quintic_step((now - self._entered) / self._entry_time)
        return self._start + share * (swing - self._start)

    def measure(self, position: float, error: float) -> None:
        """Record position and path error from /diagnostics."""
        self.lowest, self.highest = min(self.lowest, position), max(self.highest, position)
        self.error_max = max(error, self.error_max)
        self.squares, self.samples = self.squares + error * error, self.samples + 1

    @property
    def moved(self) -> float:
        """Range of the recorded positions; 0 without any."""
        return max(self.highest - self.lowest, 0.0) if self.samples else 0.0

    @property
    def error_rms(self) -> float:
        """Root mean square of the recorded path errors."""
        return math.sqrt(self.squares / self.samples) if self.samples else math.nan


class Wave(ArmDemo):
    """Demo: streams targets to the drives until time is up or Ctrl-C."""

    def __init__(
        self,
        arm: Session,
        limits: Mapping[str, JointRange],
        duration: float | None,
        groups: MovedGroups,
    ) -> None:
        del groups  # it moves those of --group or robot.yaml only, else all drives
        for name in sorted(set(arm.drives) - set(limits)):
            sys.stdout.write(
                f'warning: no joint of the description is called {name!r}; its drive stands '
                'still\n'
            )
        waving = waving_joints(arm.robot, arm.drives, joint_limits(arm.urdf))
        super().__init__(arm, limits, duration, commands(arm), waving)
        lag = 2 * math.pi / len(waving)
        self.axes = {name: Axis(limits[name], -place * lag) for place, name in enumerate(waving)}
        self._ended = threading.Event()
        self._sender = threading.Thread(target=self._send, name='wave')

    def services(self) -> Sequence[str]:
        """Return the services that halt the drives."""
        return [f'{name}/halt' for name in self.axes]

    def join(self, given_up: Callable[[], bool]) -> ServiceClient:
        """Join the ROS graph, and start sending targets."""
        client = super().join(given_up)
        self._publishers = {
            name: client.node.create_publisher(Float64, f'{name}/target', 1) for name in self.axes
        }
        self._sender.start()
        return client

    def move(self) -> None:
        """Wave, and halt the drives at the end."""
        self.enter('waving')
        begun = time.monotonic()
        self.moved = {*self.axes}
        self.wait(lambda: self.left or time.monotonic() >= begun + self.duration, math.inf, 'end')
        self._judge(time.monotonic() - begun)
        self.enter('stopping')
        self.stopping()
        halts = [f'{name}/halt' for name in self.axes if self.is_enabled(name)]
        self.client.call(halts, HALT_TIMEOUT)

    def stopping(self) -> None:
        """Stop sending targets."""
        self.moved = set()
        self._ended.set()
        self._sender.join()

    def observe(self, drive: str) -> None:
        """Read the state of a drive; an enabled one starts the wave from its present position."""
        position = number(self.drives[drive], 'position')
        if drive not in self.moved or not self.is_enabled(drive) or math.isnan(position):
            return
        axis = self.axes[drive]
        if axis.active:
            axis.measure(position, abs(number(self.drives[drive], 'following_error')))
        else:
            axis.enter(number(self.drives[drive], 'setpoint'), time.monotonic())

    def progress(self) -> str:
        """Return how many joints are enabled, the bus, and the worst path error."""
        worst = max(axis.error_max for axis in self.axes.values())
        return f'{self._enabled_text()}, {self.bus_line()}, path error {1e3 * worst:.1f} mrad'

    def _send(self) -> None:
        """Send to one drive at a time: a burst of messages would delay the cycle of the drives."""
        pause = PERIOD / len(self.axes)
        for name, axis in itertools.cycle(self.axes.items()):
            if self._ended.wait(pause):
                return
            if axis.active:
                target = axis.target(time.monotonic())
                self._publishers[name].publish(Float64(data=target))

    def _enabled_text(self) -> str:
        return f'{sum(map(self.is_enabled, self.axes))}/{len(self.axes)} joints enabled'

    def _judge(self, duration: float) -> None:
        """Summarise, and report joints that were not enabled or did not move."""
        width = max(len('joint'), *map(len, self.axes))
        head = f'{"joint":<{width}}  {"from":>8}  {"to":>8}  {"moved":>11}'
        rows = [f'{head}  {"path error max":>15}  {"rms":>6}']
        problems = []
        for name, axis in self.axes.items():
            unit, least = axis.limits.unit, LEAST_SHARE * axis.amplitude
            rows.append(
                f'{name:<{width}}  {known(axis.lowest, 3):>8}  {known(axis.highest, 3):>8}  '
                f'{axis.moved:>7.3f} {unit:<3}  {known(1e3 * axis.error_max, 2):>10} '
                f'{"m" + unit:<4}  {known(1e3 * axis.error_rms, 2):>6}'
            )
            drive = self.drives.get(name, {})
            if not self.is_enabled(name):
                why = drive.get('message') or drive.get('state') or 'no diagnostics'
                problems.append(f'{name} is not enabled: {why}')
            elif axis.moved < least:
                far = f'{axis.moved:.3f} {unit}, less than {least:g}'
                problems.append(f'{name} did not move: {far}')
        head = f'{duration:.1f} s of wave, {self._enabled_text()}'
        self.summary = [head, *rows, self.bus_line()]
        self.problems, self.warnings = problems, self.bus_warnings()


def waving_joints(robot: Robot, drives: Sequence[str], joints: Collection[str]) -> list[str]:
    """Return the joints that wave: those of the requested groups, else all joints with a drive.

    Raises:
        RobotError: A group does not exist.
        WaveError: No drive has the name of a joint.
    """
    waving: Collection[str] = drives
    if robot.groups:
        groups = moved_groups(robot)
        waving = list(itertools.chain(*(groups.joints[arm] for arm in groups.arms)))
    if found := [name for name in drives if name in joints and name in waving]:
        return found
    raise WaveError(
        f'no drive has the name of a joint; drives: {", ".join(drives)}; '
        f'joints: {", ".join(joints)}'
    )


def commands(arm: Session) -> list[str]:
    """Return suggested commands for a second terminal."""
    call, drive = 'ros2 service call', arm.ros.resolve(arm.drives[0])
    bus_config = os.path.relpath(arm.robot.bus_config)
    return [
        f'{call} {drive}/position_mode std_srvs/srv/Trigger',
        f'{call} {drive}/target canopen_interfaces/srv/COTargetDouble "{{ target: 1.0 }}"',
        f'ros2 topic hz {arm.ros.resolve("joint_states")}',
        f'ros2 run canopen_tools candump {arm.bus} --bus-config {bus_config}',
    ]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo until its end or Ctrl-C; ``argv`` defaults to the process's command line.

    Returns:
        0 on success, 1 if something failed, 2 if nothing was started.
    """
    parsed = parse(
        sys.argv[1:] if argv is None else argv,
        'demo',
        'Bring a simulated arm up, enable all its drives and let it wave. In a terminal a live '
        'table shows what it does; elsewhere a line every few seconds. Ctrl-C stops the wave, '
        'disables the drives and ends everything.',
        'end after so many seconds of wave, with a summary; the exit code says whether all '
        'joints were enabled and moved (it takes them 5 s to get going) (default: until Ctrl-C)',
    )
    return run(parsed, Wave, endless=True)
