# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The controller core, without clock or ROS: measurements in, joint targets out."""

from __future__ import annotations

from collections.abc import Sequence
import math

from quad_description import (
    DescriptionError,
    Quadruped,
    raised_feet,
    RobotState,
    STREAM_TIMEOUT,
    Targets,
)

from ..gait.generator import GaitGenerator
from ..gait.parameters import Gait, GaitParameters
from ..gait.velocity import BodyPose, REST, Velocity
from ..policy.observation import Situation
from ..policy.runner import PolicyRunner
from .get_up import get_up_refusal, stands
from .health import Commands, Health, TrackingMonitor, UnseenJoints
from .machine import NO_POLICY, PolicyChoice, Poses, StateMachine
from .modes import (
    Answer,
    Event,
    EventKind,
    Fault,
    FaultLatch,
    GAIT_STATES,
    LYING_FAULTS,
    ModeRequest,
    MODES,
    MOVING_STATES,
    Notices,
    ON_FEET,
    Output,
    parse_mode,
    State,
    StateParameters,
    Status,
    UPRIGHT_STATES,
    WAYS_DOWN,
)
from .motion import StepLimiter

MAX_STEP = 0.05  # [s] after a longer pause the gait goes on where it was instead of leaping


class Controller:
    """Moves a quadruped between lying, standing and walking, and handles all faults.

    Pass new measurements and the elapsed time to :meth:`step`; call all other methods between two
    steps. Nothing moves without a command, joint speeds limit the step between two consecutive
    targets, and faults stay latched until they are cleared.
    """

    def __init__(
        self,
        robot: Quadruped,
        gait: GaitParameters,
        states: StateParameters,
        *,
        policy: PolicyRunner | None = None,
        policy_refusal: str = NO_POLICY,
        dry_run: bool = False,
        arm_pose: Sequence[float] = (),
        first_gait: Gait = Gait.TROT,
    ) -> None:
        """Start in the state RELAX.

        Args:
            policy: Policy for the mode ``policy``.
            dry_run: Run the policy, but never send its targets.
            arm_pose: Positions of the non-leg joints when the robot stands, in [rad]; empty leaves
                them where they are.

        Raises:
            DescriptionError: The legs do not reach the heights of the parameters, or a joint has
                no speed limit.
            ParameterError: ``arm_pose`` does not match the robot.
        """
        for name, limits in zip(robot.names, robot.limits, strict=True):
            if not limits.velocity > 0.0:
                raise DescriptionError(
                    f'{name} has velocity limit {limits.velocity:g}: it can never move; '
                    'give <limit velocity="..."> of the URDF in rad/s'
                )
        poses = Poses(robot, states.lie_height, arm_pose)
        # positions of all joints that are assumed of those that are not measured [rad]
        self.fallback_positions = poses.fallback_positions
        self._generator = GaitGenerator(robot, gait, poses.fallback_positions)
        self._generator.choose(first_gait)
        self._robot = robot
        self._policies = PolicyChoice(policy, policy_refusal, dry_run=dry_run)
        self._machine = StateMachine(poses, self._generator, states, self._policies)
        self._parameters = states
        self._commands = Commands(states.command_timeout)
        self._health = Health(len(robot.names), states)
        self._limiter = StepLimiter(robot.limits, states.period, states.setpoint_speed_ratio)
        self._tracking = TrackingMonitor(robot.names)
        self._latch = FaultLatch()
        self._notices = Notices()
        self._unseen = UnseenJoints(states.hold_band)
        self._unreachable = 0
        self._policy_velocity = REST  # that a policy follows now
        self._tolerated: frozenset[Fault] = frozenset()  # present when the way down was requested

    def set_mode(self, text: str) -> Answer:
        """Request one of :data:`.modes.MODES`, or an alias; return whether it is accepted."""
        request = parse_mode(text)
        if request is None:
            return Answer(False, f'unknown mode {text!r}; choose one of {", ".join(MODES)}')
        state = self._machine.state
        if request.state is State.GET_UP and self._is_on_its_feet:
            return Answer(True, f'{self._machine.goal.value}: it is on its feet')
        if reason := self._refusal(request):
            return Answer(False, f'stays in {state.value}: {reason}')
        if request.gait is not None:
            self._generator.choose(request.gait)
        present = dict(self._health.faults()) if request.state in WAYS_DOWN else {}
        self._tolerated = frozenset(present)
        if request.state is State.GET_UP:
            self._latch.clear()  # nothing but a fall, see the refusals
        self._machine.request(request.state)
        gait = f' with gait {request.gait.value}' if request.gait is not None else ''
        way = '' if state is request.state else f', coming from {state.value}'
        without = ''.join(f'; in spite of {f.value}: {why}' for f, why in present.items())
        return Answer(True, f'{request.state.value}{gait}{way}{without}')

    @property
    def _is_on_its_feet(self) -> bool:
        machine = self._machine
        return {machine.state, machine.goal} <= ON_FEET and stands(self._health.attitude)

    def stop(self) -> Answer:
        """Reset the velocity command; end gait, policy or getting up if one is active.

        Other posture changes run to their end, because a leg may be in the air half-way.
        """
        machine = self._machine
        self._commands.set_velocity(REST)  # or the next mode would begin with the one of before
        if machine.state is State.FAULT and machine.goal is State.FAULT:
            return Answer(True, f'nothing walks: fault: {"; ".join(self._latch.texts)}')
        was = machine.title
        if not machine.stop(self._limiter.last):
            return Answer(True, f'nothing walks: {was}')
        return Answer(True, f'stopped: {was}; the mode is {machine.goal.value}')

    def set_velocity(self, velocity: Velocity) -> Answer:
        """Request a velocity; it applies until the next one or the time-out."""
        return self._commands.set_velocity(velocity)

    def set_body_pose(self, pose: BodyPose) -> Answer:
        """Request a pose of the body over its feet; it applies until the next one."""
        return self._commands.set_pose(pose)

    def clear_fault(self) -> Answer:
        """Clear the latched faults whose causes are gone; this moves nothing."""
        machine = self._machine
        if not self._latch.texts:
            return Answer(True, f'no fault; the mode is {machine.state.value}')
        if still := dict(self._health.faults()):
            gone = self._latch.keep(still)
            cleared = f'cleared {", ".join(gone)}; ' if gone else ''
            reasons = '; '.join(f'{fault.value}: {reason}' for fault, reason in still.items())
            return Answer(False, f'{cleared}still {reasons}')
        self._latch.clear()
        machine.clear()
        return Answer(True, f'cleared; the mode is {machine.state.value}')

    @property
    def policy(self) -> PolicyRunner | None:
        """Policy for the mode ``policy``."""
        return self._policies.policy

    def swap_refusal(self) -> str:
        """Return why the policy cannot be changed now; empty if it can."""
        if self._latch.texts:
            return f'{"; ".join(self._latch.texts)}; call ~/clear_fault when that is corrected'
        machine = self._machine
        if machine.state is not machine.goal:
            return f'the robot is on its way to {machine.goal.value}; ask again there'
        return ''

    def follow(self, policy: PolicyRunner | None) -> Answer:
        """Switch to another policy that matches the robot; None means the gait.

        A walking robot stops and stands first, as in every mode change, before the new policy or
        the gait takes over. If the robot lies or is relaxed, nothing moves.
        """
        machine, policies = self._machine, self._policies
        moves = machine.can_swap and not policies.dry_run
        refusal = self.swap_refusal()
        if not refusal and moves and policy is not None:
            refusal = self._health_refusal() or self._health.unmeasured(policy)
        if refusal:
            return Answer(False, f'stays as it is: {refusal}')
        text = policies.choose(policy)
        if not moves or (policy is None and machine.state is not State.POLICY):
            return Answer(True, text)
        machine.swap(State.WALK if policy is None else State.POLICY)
        return Answer(True, f'stands, then follows {policy.name if policy else "the gait"}')

    def retune(self, gait: GaitParameters) -> Answer:
        """Apply other gait parameters; only while the robot is not on its legs.

        Raises:
            DescriptionError: The legs do not reach the height.
        """
        state = self._machine.state
        if state not in {State.RELAX, State.LIE} or self._machine.goal is not state:
            return Answer(False, f'the gait is tuned lying or relaxed, and not in {state.value}')
        generator = GaitGenerator(self._robot, gait, self._generator.others)
        generator.choose(self._generator.wanted_gait)
        self._generator = generator
        self._machine.retune(generator)
        return Answer(True, 'tuned')

    @property
    def status(self) -> Status:
        """Snapshot of the controller's state."""
        health, machine = self._health, self._machine
        more = (self._commands.warning(machine.state), self._tracking.text)
        return Status(
            state=machine.state,
            title=machine.title,
            goal=machine.goal,
            gait=self._generator.gait,
            velocity=self._generator.velocity,
            faults=self._latch.texts,
            warnings=(*health.warnings, *filter(None, more)),
            joints_age=health.ages['joints'],
            imu_age=health.ages['imu'],
            battery=health.newest.battery,
            refused=health.refused + self._commands.refused,
            limited=self._limiter.limited,
            unreachable=self._unreachable,
            policy=self.policy.name if self.policy is not None else '',
        )

    def refuse(self, what: Fault, reason: str) -> None:
        """Record a received joint state or attitude that cannot be used."""
        self._health.refuse(what, reason)

    def step(self, state: RobotState, dt: float) -> Output:
        """Advance by one step; return the targets to send, and events."""
        refused = self._health.take(state, dt)
        events = [Event(EventKind.REPEATED, text) for text in refused]
        self._commands.pass_time(dt)
        last = self._last_targets(dt, events)
        if last is None:
            return Output(None, None, self._machine.title, False, tuple(events))
        self._latch_faults(last, events)
        self._advance_state(last, events)
        events += self._notices.step(self._conditions(), self._ended_conditions())
        if self._unseen.is_pending:  # targets of before would move it, those of one sample, too
            return Output(None, None, self._machine.title, self._health.complete, tuple(events))
        dt_motion = min(dt, MAX_STEP)
        situation = self._situation(dt_motion)
        wanted = self._move(situation, dt_motion, last, events)
        shadow = self._policies.watch(situation, dt_motion, last)
        targets = self._limiter.step(wanted, dt)
        if self._health.newest.joints is not None:
            self._tracking.step(targets, self._health.newest.joints.positions, dt)
        return Output(
            targets,
            shadow,
            self._machine.title,
            self._health.complete,
            tuple(events),
            situation,
            self._policies.asked(self._machine.motion) if not self._held else None,
        )

    def _last_targets(self, dt: float, events: list[Event]) -> Targets | None:
        """Return the last targets; at the start and after a pause, the joint positions."""
        if dt > STREAM_TIMEOUT and self._limiter.last:
            events += self._wake(dt, self._limiter.last)
            self._unseen.lose()
        if self._moved_unseen():
            self._limiter.reset()
        if self._limiter.last is None and self._health.newest.joints is not None:
            self._machine.hold(self._limiter.start(self._health.newest.joints.positions))
        return self._limiter.last

    def _moved_unseen(self) -> bool:
        """Whether something moved the held joints while they were not measured."""
        joints, last = self._health.newest.joints, self._limiter.last
        if joints is None or self._health.held:
            self._unseen.lose()
            return False
        if last is None or not self._machine.holds:
            self._unseen.see()
            return False
        return self._unseen.moved(joints, last)

    def _advance_state(self, last: Targets, events: list[Event]) -> None:
        """Change the state when it is due."""
        before = self._machine.state
        if failure := self._machine.advance(last):
            events.append(Event(EventKind.TROUBLE, f'the policy was given up: {failure}'))
        state = self._machine.state
        if state is not before and state is not State.FAULT:
            events.append(Event(EventKind.NEWS, f'{before.value} -> {state.value}'))

    @property
    def _held(self) -> bool:
        """Whether motion is paused because joint positions are outdated."""
        return self._health.held and Fault.JOINTS not in self._tolerated

    def _wake(self, pause: float, last: Targets) -> list[Event]:
        """Reset after a pause [s] in which the hardware node may have laid the robot down.

        The hardware node judges by the last targets it received; in motion, ours may be newer.
        """
        raised = raised_feet(self._robot.feet(last))
        if self._machine.at_rest and not raised:
            return []
        left = f'with {" or ".join(raised)} in the air' if raised else 'in motion'
        reason = (
            f'the controller itself stood still for {pause:.1f} s {left}, so the hardware node '
            'may have laid the robot down; look at what kept it, and let it stand up again'
        )
        events = self._latch_fault(Fault.PAUSE, reason, last)
        self._health.forget_joints()
        self._limiter.reset()
        return events

    def _latch_faults(self, last: Targets, events: list[Event]) -> None:
        """Latch faults while the robot is on its legs, or lying down."""
        machine = self._machine
        if machine.getting_up is not None and machine.getting_up.failure:
            events += self._latch_fault(Fault.FALLEN, machine.getting_up.failure, last)
        upright, goes_down = machine.state in UPRIGHT_STATES, machine.goal in WAYS_DOWN
        if not upright and machine.motion.finished:
            return
        watched = LYING_FAULTS - self._tolerated if goes_down or not upright else frozenset(Fault)
        if State.GET_UP in {machine.state, machine.goal}:
            watched -= {Fault.FALLEN}
        for fault, reason in self._health.faults():
            if fault in watched:
                events += self._latch_fault(fault, reason, last)

    def _conditions(self) -> dict[str, str]:
        """Return conditions that stop the robot without being a fault, by name."""
        state, conditions = self._machine.state, {}
        if stale := self._commands.warning(state):
            conditions['command'] = stale
        if self._held and (state in UPRIGHT_STATES or not self._machine.motion.finished):
            age = self._health.ages['joints'] * 1e3
            conditions['held'] = f'joint states are {age:.0f} ms old; holding the last targets'
        if self._tracking.text:
            conditions['following'] = self._tracking.text
        if self._health.uncertainty and state in UPRIGHT_STATES:
            conditions['uncertain'] = self._health.uncertainty
        policy = self.policy if state is State.POLICY else None
        if policy is not None and (inexact := policy.inexact(self._health.newest.joints)):
            conditions['velocities'] = inexact
        if (getting_up := self._machine.getting_up) is not None:
            conditions[getting_up.text] = f'get_up: {getting_up.text}'
        gait = self._generator
        if state in GAIT_STATES and gait.clamped:
            asked, walked = self._commands.velocity(state), gait.goal
            conditions['clamped'] = (
                f'{asked} is more than a {gait.gait.value} can; clamped to {walked}'
            )
        return conditions

    def _ended_conditions(self) -> dict[str, str]:
        """Return reports for conditions that ended, if the robot may move again."""
        over = {} if self._machine.state is State.FAULT else {'held': 'joint states'}
        if self._machine.state in MOVING_STATES:
            over['command'] = 'velocities'
        return {name: f'{what}: in order again' for name, what in over.items()}

    def _latch_fault(self, fault: Fault, reason: str, last: Targets) -> list[Event]:
        new = self._latch.latch(fault, reason)
        if not new and self._machine.state is State.FAULT and self._machine.goal is State.FAULT:
            return []
        reaction = self._latch.reaction
        if reaction is not None:
            self._machine.react(reaction, last)
        return [Event(EventKind.TROUBLE, f'fault, {fault.value}: {reason}')]

    def _move(
        self, situation: Situation, dt: float, last: Targets, events: list[Event]
    ) -> Targets:
        """Return the next targets of the state's motion; without measurements, the last ones."""
        if self._held:
            return last
        wanted = self._machine.motion.step(situation, dt)
        self._unreachable += not self._machine.reachable
        if all(map(math.isfinite, wanted)):
            return wanted
        reason = f'{type(self._machine.motion).__name__} returned a target that is not finite'
        events += self._latch_fault(Fault.TARGET, reason, last)
        return last

    def _situation(self, dt: float) -> Situation:
        """Return the inputs of a motion; on a state change, the velocity is zero."""
        machine = self._machine
        state = machine.state if machine.state is machine.goal else State.STAND
        velocity = self._commands.velocity(state)
        if state is State.POLICY:  # the gait does so itself; a stop needs no slope
            limits = self._generator.limits
            velocity = limits.approach(self._policy_velocity, limits.clamp(velocity), dt)
        self._policy_velocity = velocity if state is State.POLICY else REST
        return self._health.situation(velocity, self._commands.pose)

    def _refusal(self, request: ModeRequest) -> str:
        """Return why a mode cannot be entered; empty if it can."""
        if request.state in WAYS_DOWN and self._limiter.last is not None:
            return ''
        if request.state is State.GET_UP:
            if self._machine.state in ON_FEET:
                return 'it is on its legs, and tilted; a fall stops it, then it may get up'
            swings, arm = self._parameters.get_up_swings, bool(self._robot.others)
            return get_up_refusal(self._health, self._latch, swings=swings, arm=arm)
        if self._latch.texts:
            return (
                f'{"; ".join(self._latch.texts)}; call ~/clear_fault when that is corrected. '
                'The modes lie and relax are possible in spite of it'
            )
        policy = self._policies.policy if request.state is State.POLICY else None
        if request.state is State.POLICY and (reason := self._policies.mode_refusal):
            return reason
        if reason := self._health_refusal():
            return reason
        return self._health.unmeasured(policy)

    def _health_refusal(self) -> str:
        """Return why the robot must not move its legs; empty if it may."""
        present = next(self._health.faults(), None)
        return f'{present[0].value}: {present[1]}' if present else ''
