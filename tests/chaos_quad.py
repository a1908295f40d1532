# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The quadruped at a walk, with a serial cable that can be noisy."""

from __future__ import annotations

from contextlib import ExitStack
import math
import signal
import time
from typing import TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from disturbance import Disturbance, Event, full_cpu
from simulated_quad import SimulatedQuad

from quad_controller import Velocity
from quad_description import movable_joints, robot_urdf
from quad_hardware.joints import JointMap, servo_of

if TYPE_CHECKING:
    from pathlib import Path

    from isolation import Isolation
    from simulated_quad import Target
    from typing_extensions import Self

WORST_NOISE = 0.02
"""Share of the bytes in which a bit is inverted."""
LARGEST_STEP = 29.0
"""Degrees between two commands to a servo. The controller lets set-points go at 10 rad/s: 11.5 in
a period, 17.2 in one that is late, and two commands may come out as one. A trot needs that speed:
its set-points are ahead of soft servos, at 13 a period where those of firm ones have 10."""
WALKED = 0.1
"""Metres that it goes when it works, in [m]."""
STRAYED = 0.06
"""Metres that the body may go in a second without a command, as it puts its feet down, in [m]."""
ROUNDING = 0.1
"""Degrees by which an angle on the wire may be beyond a limit, which is in radians."""
GIVE = 1.0
"""Degrees beyond a limit at which a joint of the plant may be found: its stops give way like
springs, 0.2 under the folded robot. Controller and bridge begin where the joints are, and pull
none back unasked: a target may stay there, and go no farther."""
SETTLING = 3.0
"""Time in [s] in which it ends its gait, of the robot's clock."""
TIMEOUT = 20.0
"""Longest time in [s] until it walks."""
RECOVERY = 60.0
"""Longest time in [s] in which a busy computer may stop it again before it walks."""
SILENCE = 0.2
"""Time in [s] without a state of the robot, of which there are 50 a second: the simulated one, or
its cable, waits for a processor. The controller has to stop then, as with a cable pulled."""
FALLEN = math.radians(45.0)
AHEAD, BACK = Velocity(x=0.2), Velocity(x=-0.2)


class QuadVictim:
    """Walks to and fro."""

    kinds = (Disturbance.KILL, Disturbance.STOP, Disturbance.NOISE, Disturbance.FULL_CPU)
    processes = ('controller', 'hardware')

    def __init__(self, isolation: Isolation, folder: Path, seed: int) -> None:
        self._servos = {
            servo.motor: servo
            for servo in JointMap(map(servo_of, movable_joints(robot_urdf()))).servos
        }
        self._violations: list[str] = []
        self._velocity = AHEAD
        self._first = 0  # message on the joints of this round
        self._stack = ExitStack()
        try:
            self._quad = self._stack.enter_context(SimulatedQuad(isolation, folder))
            self._quad.tap.seed(seed)
            self._diagnostics = self._quad.client.listen(DiagnosticArray, '/diagnostics')
            self._quad.client.spin_until(lambda: bool(self._quad.truth), TIMEOUT, 'the truth')
            self._works_again()
        except BaseException:
            self._stack.close()
            raise

    def __enter__(self) -> Self:
        """Use it in a with statement."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop all processes."""
        self._stack.close()

    def violations(self) -> list[str]:
        """Return what was against a law since the last call."""
        found, self._violations = self._violations, []
        return found

    def round(self, event: Event) -> str:
        """Walk, be disturbed, come to rest, recover and walk again.

        Raises:
            AssertionError: It did not.
        """
        self._quad.tap.forget()
        self._first = len(self._quad.joints)
        self._diagnostics.clear()
        self._velocity = BACK if self._velocity is AHEAD else AHEAD
        self._walk(event.delay)
        self._disturb(event)
        self._check_targets()
        outcome = self._end()
        self._stays()
        if event.kind is Disturbance.KILL:
            self._quad.tap.forget()
            self._quad.start(event.process)
            self._stays()
        self._works_again()
        return outcome

    def _disturb(self, event: Event) -> None:
        if event.kind is Disturbance.FULL_CPU:
            with full_cpu():
                self._walk(event.duration)
        elif event.kind is Disturbance.NOISE:
            self._quad.tap.noise = event.severity * WORST_NOISE
            self._walk(event.duration)
            self._quad.tap.noise = 0.0
        else:
            process = self._quad.processes[event.process]
            if event.kind is Disturbance.KILL:
                process.signal(signal.SIGKILL)
                process.wait()
                self._walk(1.0)
            else:
                process.signal(signal.SIGSTOP)
                self._walk(event.duration)
                process.signal(signal.SIGCONT)

    def _end(self) -> str:
        """End all commands; where it has stopped by itself, it says why."""
        self._quad.spin(SETTLING)
        self._quad.tap.forget()
        state = self._quad.state
        if state != 'fault' or not self._quad.processes['controller'].is_running():
            return state
        words = self._reasons()
        assert words, 'is in fault, and /diagnostics does not say why'
        return f'fault: {words}'

    def _reasons(self) -> str:
        """Return what the last diagnostics complain of."""
        return '; '.join(
            dict.fromkeys(
                words
                for message in self._diagnostics[-20:]
                for status in message.status
                if status.level == DiagnosticStatus.ERROR
                for words in status.message.split('; ')
            )
        )

    def _stays(self) -> None:
        """Nothing moves without a command."""
        before = self._place()
        self._quad.spin(1.0)
        after = self._place()
        moved = math.dist(before, after)
        if moved > STRAYED:
            self._violations.append(f'went {moved:.3f} m without a command')
        if (tilt := self._quad.tilt) > FALLEN:
            self._violations.append(
                f'has fallen, it is tilted by {math.degrees(tilt):.0f} degrees'
            )

    def _works_again(self) -> None:
        """Have it walk, once more where the computer kept the robot's states from arriving."""
        end = time.monotonic() + RECOVERY
        while True:
            begin = time.monotonic()
            try:
                self._stand_and_walk()
                break
            except AssertionError:
                silent = self._quad.tap.longest_silence(begin) > SILENCE
                if not silent or time.monotonic() > end:
                    raise
        self._check_targets()

    def _stand_and_walk(self) -> None:
        """Clear the fault, as the README says; nothing moves by that; then stand up and walk."""
        self._quad.clear_fault()
        self._stays()
        self._quad.stand()
        self._quad.set_mode('walk')
        before, end = self._place(), time.monotonic() + TIMEOUT
        while math.dist(before, self._place()) < WALKED:
            stopped = self._quad.state == 'fault' or time.monotonic() > end
            assert not stopped, f'goes nowhere, in state {self._quad.state}'
            self._walk(0.5)

    def _walk(self, seconds: float) -> None:
        """Command a velocity for a time in [s]; the robot's clock may stand meanwhile."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._quad.walk(0.1, self._velocity)

    def _place(self) -> tuple[float, float]:
        position = self._quad.truth[-1].pose.pose.position
        return position.x, position.y

    def _check_targets(self) -> None:
        """Check all targets of servos since the last look."""
        targets = list(self._quad.tap.targets)
        step = self._quad.tap.largest_step()
        if step > LARGEST_STEP:
            self._violations.append(f'two targets of a servo are {step:.1f} degrees apart')
        ranges = self._ranges()
        for target in targets:
            self._violations += self._beyond(target, ranges)

    def _ranges(self) -> dict[int, tuple[float, float]]:
        """Return where targets may be by motor [deg]: in limits, or where a joint was found."""
        ranges = {}
        places: dict[str, list[float]] = {}
        for joints in list(self._quad.joints)[self._first :]:
            for name, position in zip(joints.name, joints.position, strict=True):
                places.setdefault(name, []).append(position)
        for motor, servo in self._servos.items():
            low, high = sorted((servo.angle(servo.lower), servo.angle(servo.upper)))
            found = [servo.angle(place) for place in places.get(servo.joint, [])]
            lowest, highest = min([low, *found]), max([high, *found])
            ranges[motor] = max(lowest, low - GIVE), min(highest, high + GIVE)
        return ranges

    def _beyond(self, target: Target, ranges: dict[int, tuple[float, float]]) -> list[str]:
        found = []
        for motor, angle in target.angles.items():
            servo = self._servos[motor]
            low, high = ranges[motor]
            if not low - ROUNDING <= angle <= high + ROUNDING:
                found.append(f'{servo.joint}: {angle:.1f} degrees, limits {low:.1f} {high:.1f}')
        return found
