# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot on its serial port in SI units: converts reports to states and targets to angles."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
import math
from pathlib import Path
import time

from black_box import BlackBox, BlackBoxSettings
from quad_description import preset_of, quadruped, RobotState

from .commander import JointCommander
from .estimation import Estimator, EstimatorSettings
from .exceptions import CommandError
from .joints import JointMap, LimiterSettings, NOMINAL_PERIOD
from .link import Driver, LinkOptions, LinkState, LinkStatus, Session, STALE_TIME
from .protocol import DEVELOPER
from .recording import FaultWatch, LossWatch, Opened, SerialLogFile, SerialMemory, StateEntered
from .report import check_torque_off, Report, TorqueOffResult

LINK, ROBOT, COMMANDS = 'serial link', 'robot', 'joint commands'
"""What a fault is of; diagnostics have the same names."""


JOINTS_CHECKED = 'joints_checked'
UNCHECKED_JOINTS = (
    'the joints of this robot were never checked, so nothing moves: ros2 run quad_hardware '
    'calibrate first-motion, then start with the file that it writes'
)


@dataclass(frozen=True, slots=True)
class RobotSettings:
    """Settings of the robot, of reading its reports, and of commanding it."""

    link: LinkOptions  # where the robot is
    urdf: str  # what it is
    joints: JointMap  # its servos
    # how fast targets may move, and what follows when they break off
    limiter: LimiterSettings = field(default_factory=LimiterSettings)
    # how its reports are read
    estimator: EstimatorSettings = field(default_factory=EstimatorSettings)
    # how the last bytes are written when a fault happens; None for not at all
    black_box: BlackBoxSettings | None = None
    serial_log: Path | None = None  # where all bytes are written to as they pass; None for nowhere
    # each joint has moved as its servo says (calibrate first-motion); else nothing is commanded
    joints_checked: bool = True


class ObservedRobot:
    """Converts a robot's reports to states; on a serial line, or in a log."""

    def __init__(self, settings: RobotSettings) -> None:
        """Start without a report.

        Raises:
            CommandError: The legs of the URDF cannot be read.
        """
        self.names = settings.joints.names  # joints in the order of the URDF
        # the newest state, None while the link does not run
        self.latest: RobotState | None = None
        # called with each report as a state in SI units
        self.on_state: Callable[[RobotState], None] = lambda _: None
        # called with the state of the link when it changes, and its detail
        self.on_change: Callable[[LinkState, str], None] = lambda *_: None
        # called with the reason why a report cannot be
        self.on_refusal: Callable[[str], None] = lambda _: None
        self._settings = settings
        self._begin()
        # how a link is turned in the body
        self.rotation_of = quadruped(settings.urdf).rotation_of

    def _begin(self) -> None:
        settings = self._settings
        self._estimator = Estimator(settings.urdf, settings.joints, settings.estimator)

    @property
    def gravity_error(self) -> float | None:
        """Angle between accelerometer and attitude [rad]; None if unknown."""
        return self._estimator.gravity_error

    def status(self) -> LinkStatus:
        """Return the link status."""
        raise NotImplementedError

    def _report(self, report: Report) -> str:
        """Process a report; return why it is implausible, or an empty text."""
        state = self._estimator.step(report)
        if state is None:
            self.on_refusal(self._estimator.refusal)
            return self._estimator.refusal
        if not self._settings.joints_checked:
            problem = f'{state.servo_problem}; ' if state.servo_problem else ''
            state = replace(state, servo_problem=problem + UNCHECKED_JOINTS)
        self.latest = state
        self.on_state(state)
        return ''


class SerialRobot(ObservedRobot):
    """Combines driver, estimator and joint commander for one robot.

    The driver's thread calls the callbacks, except ``on_warning``; call all methods from one other
    thread. Times are on the monotonic clock [s].
    """

    def __init__(self, settings: RobotSettings) -> None:
        """Set up the robot; :meth:`start` opens the port.

        Raises:
            CommandError: The legs of the URDF cannot be read.
            RecordingError: The serial log cannot be written.
        """
        super().__init__(settings)
        # called with what is wrong with a command
        self.on_warning: Callable[[str], None] = lambda _: None
        self._arrived_at = -math.inf  # [s] when the latest report did
        self._joints = settings.joints
        self._commander = JointCommander(
            settings.joints,
            settings.limiter,
            raised=self._estimator.raised_feet,
            send=self._send_angles,
            waits=lambda: self._driver.waits,
            obstacle=self._obstacle,
            warn=self._warn,
        )
        self.counters = self._commander.counters  # what became of joint commands
        self._reach = len(self.names)  # how many joints the protocol has servos for
        self._last_note = ''
        self._seen: Report | None = None  # the newest that can be
        self._let_go_at = -math.inf  # [s] when that was last requested
        self._recorders: list[SerialMemory | SerialLogFile] = []
        self._log_file: SerialLogFile | None = None
        # writes the last bytes when a fault happens; None without
        self.black_box: BlackBox | None = None
        port = settings.link.path
        if settings.black_box is not None:
            memory = SerialMemory(port, settings.black_box.window)
            self._recorders.append(memory)
            self.black_box = BlackBox(f'serial_{port}', memory, settings.black_box)
        if settings.serial_log is not None:
            self._log_file = SerialLogFile(settings.serial_log)
            self._recorders.append(self._log_file)
        self._losses, self._faults = LossWatch(), FaultWatch()
        link = replace(settings.link, preset=preset_of(settings.urdf))
        self._driver = Driver(link, self._report, self._link_changed, self._opened)
        # time after the last command at which :meth:`miss_commands` is to be called [s]
        self.timeout = self._commander.timeout

    def start(self, begin: Callable[[], None] = lambda: None) -> None:
        """Start looking for the robot; the driver's thread calls ``begin`` first."""
        if self.black_box is not None:
            self.black_box.start()
        self._driver.start(begin)

    def end(self, report_loss: Callable[[str], None]) -> None:
        """Lay the robot down if it cannot be left as it is, report why, and close the port."""
        while (loss := self.miss_commands()) is None:
            time.sleep(NOMINAL_PERIOD)
        if loss:
            report_loss(loss)
        while self._commander.goes_down:
            self.go_down()
            time.sleep(NOMINAL_PERIOD)
        self._driver.stop()
        if self.black_box is not None:
            self.black_box.close()
        if self._log_file is not None:
            self._log_file.close()

    def status(self) -> LinkStatus:
        """Return the present link status."""
        return self._driver.status()

    # -- what may be done to it

    def command(self, positions: Sequence[float]) -> bool:
        """Send targets of the first joints [rad], [m]; return whether they were sent."""
        if not self._settings.joints_checked:
            self.refuse(CommandError(UNCHECKED_JOINTS))
            return False
        self.counters.received += 1
        now = time.monotonic()
        if len(positions) == len(self.names) > self._reach:
            positions = positions[: self._reach]
            self._warn('the developer firmware moves no arm: its joints stay as they are')
        command = self._commander.take(positions, self._place(now), now)
        if command is not None:
            self._estimator.command(command.targets)
        return command is not None

    def refuse(self, error: CommandError) -> None:
        """Count an invalid command."""
        self.counters.received += 1
        self._commander.refuse(error)

    @property
    def is_commanded(self) -> bool:
        """Whether joint commands are arriving."""
        return self._commander.is_commanded(time.monotonic())

    def miss_commands(self) -> str | None:
        """Begin to lay the robot down if missing commands are a hazard.

        Returns:
            What it does, or why not; empty if there is no hazard; None to call again, because a
            report is pending.
        """
        now, latest = time.monotonic(), self.latest
        imu = None if latest is None else latest.imu
        loss = self._commander.miss(self._place(now), None if imu is None else imu.tilt, now)
        if loss:
            self.fault(COMMANDS, loss)
        return loss

    def go_down(self) -> None:
        """Send the next targets on the way down, if a report shows the legs."""
        now = time.monotonic()
        command = self._commander.go_down(self._place(now), now)
        if command is not None:
            self._estimator.command(command.targets)

    @property
    def goes_down(self) -> bool:
        """Whether the robot is lying down because commands broke off."""
        return self._commander.goes_down

    def set_torque(self, *, on: bool) -> bool:
        """Switch torque off, or on at the present angles; return whether this is sent.

        An earlier stream of commands does not continue if the legs have moved.
        """
        positions = self._place(time.monotonic())
        if on and positions:  # a servo that wakes goes to its last target
            self._driver.command(self._joints.angles_at(positions))
        sent = self._driver.torque(on=on)
        if sent:
            self._let_go_at = time.monotonic()
            self._commander.let_go()
        return sent

    def check_torque_off(self) -> TorqueOffResult | None:
        """Return the result of torque off; None while a later report may decide it."""
        motors = [servo.motor for servo in self._joints.servos]
        sent_at, now = self._driver.released_at, time.monotonic()
        return check_torque_off(self._seen, motors, self._let_go_at, sent_at, now)

    # -- for the black box

    def fault(self, subject: str, text: str) -> None:
        """Report a fault to the black box, if there is one; never blocks."""
        if self.black_box is not None:
            self.black_box.fault(subject, text)

    def _note(self, subject: str, text: str) -> None:
        """Add a note to the black box's next report; a repeated text only once."""
        if self.black_box is not None and text != self._last_note:
            self._last_note = text
            self.black_box.note(subject, text)

    def _warn(self, text: str) -> None:
        self._note(COMMANDS, text)
        self.on_warning(text)

    # -- in the thread of the driver

    def _opened(self, session: Session) -> None:
        port, protocol = session.port, session.dialect.protocol
        now, name, model = time.monotonic(), protocol.name, session.model
        spans = session.dialect.spans
        self._reach = self._joints.leg_count if protocol is DEVELOPER else len(self.names)
        self._commander.limit_to(self._joints.within(spans) if spans else self._joints)
        opened = Opened(now, port.path, port.baud, name, session.firmware, model)
        for recorder in self._recorders:
            recorder.event(opened)
        port.recorders = [recorder.transfer for recorder in self._recorders]

    def _report(self, report: Report) -> str:
        arrived, self._arrived_at = self._arrived_at, report.arrival
        refusal = super()._report(report)
        if refusal:
            self._arrived_at = arrived
            self._note(LINK, f'report refused: {refusal}')
            return refusal
        self._seen = report
        if self.black_box is not None and self.latest is not None:
            for fault in self._faults.check(report, self.latest):
                self.black_box.fault(ROBOT, fault)
        return refusal

    def _link_changed(self, state: LinkState, detail: str) -> None:
        entered = StateEntered(time.monotonic(), state, detail)
        for recorder in self._recorders:
            recorder.event(entered)
        keep = self.fault if self._losses.is_lost(state) else self._note
        keep(LINK, f'{state.value}: {detail}')
        if state is not LinkState.RUNNING:
            self.latest = None  # the robot may be moved while it is not seen
            self._commander.lose()
        self.on_change(state, detail)

    # -- for the commander

    def _send_angles(self, angles: Mapping[int, float]) -> bool:
        return not self._driver.limp and self._driver.command(angles)

    def _obstacle(self) -> str:
        """Return why nothing can be sent to the servos; empty if it can."""
        status = self._driver.status()
        if self._driver.limp and status.state is LinkState.RUNNING:
            return 'the servos are without torque; call ~/torque with true'
        return status.detail

    def _place(self, now: float) -> dict[str, float]:
        """Return the joint positions [rad], [m]; empty without a recent report."""
        latest = self.latest
        if latest is None or latest.joints is None or now - self._arrived_at > STALE_TIME:
            return {}
        if self._driver.status().state is not LinkState.RUNNING:  # a first report is on its way
            return {}
        return latest.joints.measured(self.names)
