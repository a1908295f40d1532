# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_bringup demo``: a simulated arm boots, enables and waves.

Every joint swings about the middle of its range, each a little later than the last. The demo
streams targets to the drives, as any client may; a drive that something else stops or moves
leaves the wave, and comes back when ``wave/start`` is called.
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
from std_srvs.srv import Trigger
from urdf_reader import JointRange

from ..description import joint_limits
from ..exceptions import WaveError
from ..groups import joints_of_groups, moved_groups, MovedGroups
from ..robots import Robot
from ..service_client import ServiceClient
from ..session import Session
from .arm import ArmDemo, known, number, parse, run

SWING_TIME = 5.0  # time of one swing in [s]
OMEGA = 2 * math.pi / SWING_TIME  # angular velocity of the wave in [rad/s]
AMPLITUDE, RANGE_SHARE = 0.45, 0.5
"""Greatest amplitude in [rad] or [m]; the swing covers at most this share of a joint's range."""
VELOCITY_SHARE, MAX_VELOCITY = 0.6, 1.2
"""Greatest speed: as a share of a joint's limit, and in [rad/s] or [m/s], since drives approach
their targets at that speed or less and some URDFs have limits of thousands."""
SHORTEST_ENTRY = 2.0  # a joint takes at least this long to enter in [s]
PERIOD = 0.04  # time between two targets of a drive in [s]
FOLLOWING_MODES = ('Interpolated position', 'Cyclic position')
"""Titles of the modes in which a drive follows targets along a path (7 and 8)."""
READY_WITHIN = 5.0
"""Time in [s] within which a drive that was asked for has to be ready; later it stays out."""
STANDING, BESIDE = 3, 0.1
"""Observations in which a set-point stands beside the wave before something else has moved it, and
the distance, as a share of the amplitude, from which on it is beside the wave."""
LEAST_MOTION, LEAST_MOTION_SHARE, LEAST_MOTION_TIME = 0.1, 0.1, 0.2
"""A joint that moved less than the least of these did not wave: in [rad] or [m], as a share of its
range, and in [s] at its greatest speed."""
WORST_PATH_ERROR = 2.0  # a joint that was as many times as far from its set-point did not follow
HALT_TIMEOUT = 10.0  # longest time in [s] for the drives to come to rest


def quintic_step(x: float) -> float:
    """Go from 0 at x <= 0 to 1 at x >= 1 with two continuous derivatives; its slope is <= 15/8."""
    x = min(max(x, 0.0), 1.0)
    return min(x * x * x * (10.0 + x * (6.0 * x - 15.0)), 1.0)  # rounding may pass 1


@dataclass
class Axis:
    """One drive: its swing, whether it is in the wave, and how well it follows.

    Positions are in [rad] or [m], times on the steady clock in [s].

    Attributes:
        limits: Range and speed of its joint.
        phase: How far it is ahead in [rad].
        active: It is in the wave.
        left: Why it is in it no more; empty when it is, or never was.
    """

    limits: JointRange
    phase: float
    centre: float = field(init=False)
    amplitude: float = field(init=False)
    velocity: float = field(init=False)  # that it never exceeds
    active: bool = False
    left: str = ''
    lowest: float = math.inf
    highest: float = -math.inf
    error_max: float = math.nan
    squares: float = 0.0  # of the path error
    samples: int = 0
    _wanted: bool = False
    _wanted_since: float = math.nan  # when it was first observed after that
    _start: float = math.nan
    _entered: float = math.nan
    _entry_time: float = SHORTEST_ENTRY
    _target: float = math.nan
    _setpoint: float = math.nan
    _standing: int = 0

    def __post_init__(self) -> None:
        """Choose centre and amplitude within the limits; without a range it swings about zero.

        Raises:
            WaveError: The joint has no range, or may not move.
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

    def target(self, now: float) -> float:
        """Return where it is to be while it is in the wave.

        With the quintic step r and an entry of time T, p(t) = start + r(t/T) (centre +
        A sin(omega t + phase) - start) begins at rest, is twice continuously differentiable, and
        as a convex combination never leaves the hull of start and swing. With D = |centre - start|
        its speed is at most (D + A) 15/8/T + A omega; T is chosen so that this is the limit.
        """
        swing = self.centre + self.amplitude * math.sin(OMEGA * now + self.phase)
        share = quintic_step((now - self._entered) / self._entry_time)
        self._target = self._start + share * (swing - self._start)
        return self._target

    def ask(self) -> None:
        """Request that it joins as soon as it stands and can follow."""
        self._wanted, self._wanted_since = True, math.nan

    def observe(self, drive: Mapping[str, str], now: float, *, enabled: bool) -> None:
        """See what /diagnostics has of it: enter, measure, or leave."""
        setpoint = number(drive, 'setpoint')
        stands, self._setpoint = setpoint == self._setpoint, setpoint
        follows = enabled and drive.get('mode') in FOLLOWING_MODES
        if self.active:
            reason = self._lost(drive, stands=stands, enabled=enabled, follows=follows)
            if reason:
                self.leave(reason)
            else:
                self._measure(number(drive, 'position'), abs(number(drive, 'following_error')))
        elif self._wanted:
            if math.isnan(self._wanted_since):
                self._wanted_since = now
            if stands and follows:
                self._enter(setpoint, now)
            elif now - self._wanted_since > READY_WITHIN:
                self._wanted = False

    def leave(self, reason: str) -> None:
        """Stop the wave."""
        self.active, self._wanted, self.left = False, False, reason

    @property
    def moved(self) -> float:
        """Range of its positions; 0 before there is one."""
        return max(self.highest - self.lowest, 0.0) if self.samples else 0.0

    @property
    def error_rms(self) -> float:
        """Root mean square of the path error."""
        return math.sqrt(self.squares / self.samples) if self.samples else math.nan

    @property
    def least_motion(self) -> float:
        """How far it must move to count as moved."""
        limits = self.limits
        bounds = [LEAST_MOTION, LEAST_MOTION_SHARE * (limits.upper - limits.lower)]
        return min(*bounds, LEAST_MOTION_TIME * limits.velocity)

    def _enter(self, setpoint: float, now: float) -> None:
        way = abs(self.centre - setpoint) + self.amplitude
        spare = self.velocity - self.amplitude * OMEGA
        self._entry_time = max(SHORTEST_ENTRY, way * 15 / 8 / spare)
        self._start = self._target = setpoint
        self._entered, self.active = now, True
        self._wanted, self._standing, self.left = False, 0, ''

    def _measure(self, position: float, error: float) -> None:
        self.lowest, self.highest = min(self.lowest, position), max(self.highest, position)
        self.error_max = max(error, self.error_max) if self.samples else error
        self.squares, self.samples = self.squares + error * error, self.samples + 1

    def _lost(
        self, drive: Mapping[str, str], *, stands: bool, enabled: bool, follows: bool
    ) -> str:
        """Return why something else has it; empty when the wave has."""
        if not enabled:
            return f'it is not enabled: {drive.get("message") or drive.get("state")}'
        if not follows:
            return f'it is in mode {drive.get("mode")}'
        beside = abs(self._target - self._setpoint) > BESIDE * self.amplitude
        self._standing = self._standing + 1 if stands and beside else 0
        if self._standing < STANDING:
            return ''
        return f'it was halted or sent elsewhere: its set-point stands at {self._setpoint:.3f}'


class Wave(ArmDemo):
    """Streams targets to the drives that are in the wave, until the time is over or Ctrl-C."""

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
        self._departures: list[str] = []
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._sender = threading.Thread(target=self._send, name='wave')

    def services(self) -> Sequence[str]:
        """Return the services that halt the drives."""
        return [f'{name}/halt' for name in self.axes]

    def join(self, given_up: Callable[[], bool]) -> ServiceClient:
        """Join the ROS graph, and begin to send."""
        client = super().join(given_up)
        self._publishers = {
            name: client.node.create_publisher(Float64, f'{name}/target', 1) for name in self.axes
        }
        client.node.create_service(Trigger, 'wave/start', self._start)
        self._sender.start()
        return client

    def move(self) -> None:
        """Wave, and halt the drives that are in the wave at the end."""
        self._ask()
        self.enter('waving')
        begun = time.monotonic()
        self.wait(lambda: self._ends(begun + self.duration), math.inf, 'the end')
        self._judge(time.monotonic() - begun)
        self.enter('stopping')
        with self._lock:
            active = [name for name, axis in self.axes.items() if axis.active]
            for axis in self.axes.values():
                axis.leave('')
        if active:
            self.client.call([f'{name}/halt' for name in active], HALT_TIMEOUT)

    def stopping(self) -> None:
        """Send nothing more."""
        self._ended.set()
        self._sender.join()

    def observe(self, drive: str) -> None:
        """See how a drive is; one that something else moves leaves the wave."""
        if drive not in self.axes:
            return
        axis, enabled = self.axes[drive], self.is_enabled(drive)
        with self._lock:
            before = axis.active
            axis.observe(self.drives[drive], time.monotonic(), enabled=enabled)
            if before and not axis.active:
                self._departures.append(f'{drive} left the wave: {axis.left}')
            self.moved = {name for name, each in self.axes.items() if each.active}

    def progress(self) -> str:
        """Return how many joints are enabled, the bus, and the worst path error."""
        error = ''
        if measured := [axis for axis in self.axes.values() if axis.samples]:
            worst = max(measured, key=lambda axis: axis.error_max / axis.least_motion)
            error = f', path error {known(1e3 * worst.error_max, 1)} m{worst.limits.unit}'
        return f'{self._enabled_text()}, {self.bus_line()}{error}'

    def _ends(self, end: float) -> bool:
        """Report which drives left the wave; return whether it ends."""
        with self._lock:
            departures, self._departures = self._departures, []
        for text in departures:
            self.warn(text)
        return self.left or time.monotonic() >= end

    def _ask(self) -> None:
        """Request that every drive joins that stands and can follow; active ones continue."""
        with self._lock:
            for axis in self.axes.values():
                if not axis.active:
                    axis.ask()

    def _start(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._ask()
        response.success = True
        response.message = (
            f'the wave takes in each of its {len(self.axes)} drives that is enabled, in a '
            'mode that follows targets (7 or 8), and stands'
        )
        return response

    def _send(self) -> None:
        """Send to one drive after the other: many messages at a time would hold up their cycle."""
        pause = PERIOD / len(self.axes)
        for name, axis in itertools.cycle(self.axes.items()):
            if self._ended.wait(pause):
                return
            with self._lock:  # what is stopped in it gets no target any more
                if axis.active:
                    target = axis.target(time.monotonic())
                    self._publishers[name].publish(Float64(data=target))

    def _enabled_text(self) -> str:
        return f'{sum(map(self.is_enabled, self.drives))}/{len(self.axes)} joints enabled'

    def _judge(self, duration: float) -> None:
        """Sum up, and say which joints were not enabled, did not move, or did not follow."""
        width = max(len('joint'), *map(len, self.axes))
        head = f'{"joint":<{width}}  {"from":>8}  {"to":>8}  {"moved":>11}'
        rows = [f'{head}  {"path error max":>15}  {"rms":>6}']
        problems = []
        for name, axis in self.axes.items():
            unit, least = axis.limits.unit, axis.least_motion
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
            elif axis.error_max > WORST_PATH_ERROR * least and not self.missed:
                problems.append(f'{name} was {axis.error_max:.3f} {unit} away from its path')
        head = f'{duration:.1f} s of wave, {self._enabled_text()}'
        self.summary = [head, *rows, self.bus_line()]
        self.problems, self.warnings = problems, self.bus_warnings()


def waving_joints(robot: Robot, drives: Sequence[str], joints: Collection[str]) -> list[str]:
    """Return the joints that wave: those of the groups that are asked for, else all with a drive.

    Raises:
        RobotError: There is no such group.
        WaveError: No drive has the name of a joint.
    """
    waving: Collection[str] = drives
    if robot.groups:
        groups = joints_of_groups(robot, MovedGroups(moved_groups(robot).arms))
        waving = list(itertools.chain(*groups.values()))
    if found := [name for name in drives if name in joints and name in waving]:
        return found
    raise WaveError(
        f'no drive has the name of a joint; drives: {", ".join(drives)}; '
        f'joints: {", ".join(joints)}'
    )


def commands(arm: Session) -> list[str]:
    """Return commands to try in a second terminal."""
    call, drive = 'ros2 service call', arm.ros.resolve(arm.drives[0])
    bus_config = os.path.relpath(arm.robot.bus_config)
    return [
        f'{call} {drive}/position_mode std_srvs/srv/Trigger',
        f'{call} {drive}/target canopen_interfaces/srv/COTargetDouble "{{ target: 1.0 }}"',
        f'ros2 topic hz {arm.ros.resolve("joint_states")}',
        f'ros2 run canopen_tools candump {arm.bus} --bus-config {bus_config}',
        # back into the wave
        f'{call} {drive}/{arm.mode_service} std_srvs/srv/Trigger',
        f'{call} {arm.ros.resolve("wave/start")} std_srvs/srv/Trigger',
    ]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo until its end or Ctrl-C; the command line is that of the process by default.

    Returns:
        0 when all went well, 1 when something did not, 2 when nothing was started.
    """
    parsed = parse(
        sys.argv[1:] if argv is None else argv,
        'demo',
        'Bring a simulated arm up, enable all its drives and let it wave. In a terminal a live '
        'table shows what it does; elsewhere a line every few seconds. Ctrl-C stops the wave, '
        'disables the drives and ends everything.',
        'end after so many seconds of wave, with a summary; the exit code says whether all '
        'joints were enabled, moved (it takes them 5 s to get going) and followed (default: until '
        'Ctrl-C)',
    )
    return run(parsed, Wave, endless=True)
