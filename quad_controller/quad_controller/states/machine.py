# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""State machine: the sequence of motions from one state to another.

::

    RELAX <-> LIE <-> STAND <-> WALK, TURN      (the gait comes to rest before it is left)
                        ^-----> POLICY          (eased in; winds down, or fails, back to STAND)
    POLICY -> STAND -> POLICY or WALK           (another policy, or the gait, takes its place)
    RELAX, LIE, FAULT (a fall) -> GET_UP -> STAND   (or FAULT again; see get_up.py)
    any but RELAX and LIE at rest -> FAULT      (then RELAX, LIE or STAND when it is cleared)
    FAULT -> LIE -> RELAX                       (a way down is possible with any fault)

From RELAX the robot stands up directly, from wherever its joints are.
"""

from __future__ import annotations

from collections.abc import Sequence

from quad_description import Quadruped, Targets

from ..exceptions import ParameterError
from ..gait.generator import GaitGenerator
from ..policy.observation import Situation
from ..policy.runner import PolicyRunner, PolicyStep
from .get_up import GetUp
from .modes import Asked, GAIT_STATES, MOVING_STATES, Reaction, State, StateParameters
from .motion import Blend, Hold, Motion, Walk

EASE_TIME = 0.7  # [s] over which a policy takes over


class Poses:
    """Target poses of the robot; non-leg joints have a configured pose, or stay."""

    def __init__(self, robot: Quadruped, lie_height: float, arm_pose: Sequence[float]) -> None:
        """Compute the poses.

        Args:
            lie_height: Height of the hip axes above the foot centres when lying, in [m].
            arm_pose: Positions of the non-leg joints in [rad]; empty leaves them where they are.

        Raises:
            DescriptionError: The legs do not reach the height.
            ParameterError: The numbers of positions and joints differ.
        """
        if arm_pose and len(arm_pose) != len(robot.others):
            names = ', '.join(robot.names[index] for index in robot.others) or 'none'
            raise ParameterError(
                f'arm_pose has {len(arm_pose)} positions; the joints of the arm are {names}'
            )
        self.robot = robot
        self._arm = dict(zip(robot.others, arm_pose, strict=True)) if arm_pose else {}
        # positions of all joints that are assumed of those that are not measured [rad]
        self.fallback_positions = self.with_arm([0.0] * len(robot.names))
        self._lying = robot.solve(robot.footprint(lie_height, self.fallback_positions))

    def with_arm(self, targets: Sequence[float]) -> Targets:
        """Set the non-leg joints among all targets to the configured pose."""
        moved = [self._arm.get(index, target) for index, target in enumerate(targets)]
        return self.robot.clamp(moved)

    def lying(self, targets: Targets) -> Targets:
        """Return the targets of all joints with the legs folded."""
        return self.robot.place(self._lying, targets)


NO_POLICY = 'no policy is loaded (parameter policy, or ~/load_policy)'

MAX_BAD_STEPS = 3  # in a row; one may be a glitch, the robot stands on its last targets meanwhile
WIND_DOWN = 0.5  # [s] without velocity before the gait takes over


class PolicyMotion(Motion):
    """Moves the joints by a policy."""

    def __init__(self, policy: PolicyRunner, start: Targets, ease_time: float) -> None:
        """Start at the last targets [rad]; blend to the policy's in the ease time [s]."""
        policy.reset(start)
        self.policy = policy
        # what it answered last; None when there was nothing to ask it by
        self.answer: PolicyStep | None = None
        self.steps = 0  # how often it was stepped
        self._start = self._last = start
        self._ease_time = ease_time
        self._time = 0.0
        self._rest_time = 0.0
        self._bad_steps = 0

    @property
    def settled(self) -> bool:
        """Whether the robot has had time to stop, or the policy has failed."""
        return self._rest_time >= WIND_DOWN or bool(self.failure)

    def step(self, situation: Situation, dt: float) -> Targets:
        """Return the next targets; the last ones if inputs are missing."""
        self._rest_time = self._rest_time + dt if situation.velocity.at_rest else 0.0
        self.answer = None
        if situation.joints is None or situation.imu is None:
            return self._last
        self.steps += 1
        step = self.answer = self.policy.step(situation, dt)
        if step.targets is None:
            self._bad_steps += 1
            if self._bad_steps >= MAX_BAD_STEPS:
                self.failure = step.reason
            return self._last
        self._bad_steps = 0
        self._time += dt
        share = min(self._time / self._ease_time, 1.0) if self._ease_time > 0.0 else 1.0
        self._last = tuple(
            a + share * (b - a) for a, b in zip(self._start, step.targets, strict=True)
        )
        return self._last


class PolicyChoice:
    """The selected policy: for the mode ``policy``, or only observed in a dry run."""

    def __init__(self, policy: PolicyRunner | None, refusal: str, *, dry_run: bool) -> None:
        """Start with a policy, or with the reason for its absence."""
        self.policy, self._refusal = policy, refusal
        self.dry_run = dry_run  # whether it is only asked, and never followed
        self._watched_steps = 0
        self._asked: Asked | None = None

    @property
    def mode_refusal(self) -> str:
        """Why the mode ``policy`` is not available; empty if it is."""
        if self.policy is None:
            return self._refusal
        if self.dry_run:
            return 'the policy is only watched in a dry run (parameter policy_dry_run)'
        return ''

    def choose(self, policy: PolicyRunner | None) -> str:
        """Select another policy; return the response for a robot at rest."""
        self.policy, self._watched_steps, self._asked = policy, 0, None
        if policy is None:
            self._refusal = NO_POLICY
            return 'no policy is loaded any more'
        if self.dry_run:
            return f'{policy.name} is watched (parameter policy_dry_run)'
        return f'the mode policy follows {policy.name}'

    def watch(self, situation: Situation, dt: float, last: Targets) -> Targets | None:
        """Return the targets of a policy in a dry run; None without one."""
        self._asked = None
        unknown = situation.joints is None or situation.imu is None
        if self.policy is None or not self.dry_run or unknown:
            return None
        if not self._watched_steps:
            self.policy.reset(last)
        self._watched_steps += 1
        answer = self.policy.step(situation, dt)
        self._asked = Asked(self.policy, answer, self._watched_steps)
        return answer.targets

    def asked(self, motion: Motion) -> Asked | None:
        """Return the last answer of the policy that is in use or in a dry run."""
        if self._asked is not None or not isinstance(motion, PolicyMotion):
            return self._asked
        return Asked(motion.policy, motion.answer, motion.steps) if motion.answer else None


class StateMachine:
    """Changes the state, and owns the motion of each."""

    def __init__(
        self,
        poses: Poses,
        generator: GaitGenerator,
        parameters: StateParameters,
        policies: PolicyChoice,
    ) -> None:
        """Start relaxed, without targets."""
        self._poses, self._generator, self._policies = poses, generator, policies
        self._parameters = parameters
        self._walk = Walk(generator)
        self._lie_down: Blend | None = None
        self._reaction: Reaction | None = None
        self._after_standing: State | None = None
        self.state = self.goal = State.RELAX  # that of now, and the one requested
        self.motion: Motion = self._walk  # what moves the joints now

    @property
    def title(self) -> str:
        """Name of the state, with the transition while it stands up, lies down or stops."""
        if self.state is State.GET_UP:
            return State.GET_UP.value
        there = self.at_rest if self.state is State.STAND else self.motion.finished
        return self.state.value if there else f'to {self.state.value}'

    @property
    def at_rest(self) -> bool:
        """Whether no leg is moving."""
        return self.motion.settled and self.motion.finished

    @property
    def holds(self) -> bool:
        """Whether all joints are held: relaxed, in a fault that holds, or lying."""
        lies = isinstance(self.motion, Blend) and self.motion.finished
        return lies or isinstance(self.motion, Hold)

    @property
    def reachable(self) -> bool:
        """Whether the gait's last step was within reach of the legs."""
        return self.motion is not self._walk or self._walk.reachable

    @property
    def getting_up(self) -> GetUp | None:
        """The motion that gets the robot up after a fall; None if inactive."""
        return self.motion if isinstance(self.motion, GetUp) else None

    def retune(self, generator: GaitGenerator) -> None:
        """Use another gait generator; call only while no leg is walking."""
        walk = Walk(generator)
        if self.motion is self._walk:
            self.motion = walk
        self._generator, self._walk = generator, walk

    def hold(self, last: Targets) -> None:
        """Hold some targets [rad]."""
        self.motion = Hold(last, self._parameters.hold_band)

    def stop(self, last: Targets | None) -> bool:
        """End velocity control or getting up; return whether either was active.

        If the legs already carry the robot, it continues to stand up, as from every other posture.
        """
        self._after_standing = None
        if self.state is State.GET_UP and last is not None:
            rises = self.getting_up is not None and self.getting_up.rises
            self.goal = State.STAND if rises else State.RELAX
            self._enter(self.goal, last)
            return True
        if self.goal is State.GET_UP:  # it has not begun
            self.goal = self.state = State.RELAX if self.state is State.FAULT else self.state
            return True
        if self.goal in MOVING_STATES:
            down = self.state in {State.LIE, State.RELAX}
            self.request(self.state if down else State.STAND)
            return True
        return self.state in MOVING_STATES

    def request(self, goal: State) -> None:
        """Set the goal state; out of FAULT, only a way down."""
        self.goal = goal
        self._reaction = self._after_standing = None

    @property
    def can_swap(self) -> bool:
        """Whether gait or policy moves the robot, and no state change is in progress."""
        walks = self.motion is self._walk or isinstance(self.motion, PolicyMotion)
        return walks and self.state is self.goal and self.state is not State.FAULT

    def swap(self, goal: State) -> None:
        """Stand, then go on to a state; requires :attr:`can_swap`."""
        self.request(State.STAND)
        self._after_standing = goal

    def react(self, reaction: Reaction, last: Targets) -> None:
        """Enter FAULT, or escalate to a stronger reaction there."""
        if self.state is State.GET_UP:
            reaction = Reaction.HOLD  # legs that bear nothing can neither stand nor lie down
        elif self.state is State.FAULT and self._reaction is not None:
            reaction = max(reaction, self._reaction)
        self.state = self.goal = State.FAULT
        self._reaction, self._after_standing = reaction, None
        if reaction is Reaction.HOLD:
            self.hold(last)

    def clear(self) -> None:
        """Leave FAULT for the state that fits the posture; a way down continues."""
        if self.state is not State.FAULT:
            return
        if self.goal is not State.FAULT:
            self.state = State.STAND
        elif self._reaction is Reaction.HOLD:
            self.state = self.goal = State.RELAX
        elif self._reaction is Reaction.LIE_DOWN:
            lies = self.motion is self._lie_down
            self.state, self.goal = State.LIE if lies else State.STAND, State.LIE
        else:
            self.state = self.goal = State.STAND
        self._reaction = None

    def advance(self, last: Targets) -> str:
        """Change state and motion when due; return why the policy was given up."""
        failure = self.motion.failure
        if self.state is State.FAULT and self.goal is State.FAULT:
            self._advance_fault(last)
            return failure
        if failure:
            walks = self._parameters.policy_fallback_walks and self.goal is State.POLICY
            if self.goal is State.POLICY:
                self.goal = State.WALK if walks else State.STAND
            self._enter(State.STAND, last)
        self._stand_after_blend()
        if self.state is self.goal is State.GET_UP and self.motion.finished:
            self.goal = State.STAND
        if self.state is self.goal is State.STAND and self._after_standing is not None:
            self.request(self._after_standing)
        following = self._next()
        if following is not None:
            self._enter(following, last)
        return failure

    def _next(self) -> State | None:
        """Return the next state on the way to the goal; None to stay."""
        state, goal, motion = self.state, self.goal, self.motion
        if state is goal:
            return None
        if state in GAIT_STATES and goal in GAIT_STATES | {State.POLICY}:
            ready = motion is self._walk and (goal in GAIT_STATES or motion.settled)
            return goal if ready else None
        if not motion.settled:
            return None
        if goal is State.GET_UP:
            return State.GET_UP
        if goal is State.LIE or (goal is State.RELAX and state is not State.LIE):
            return State.LIE
        if goal is State.RELAX:
            return State.RELAX if motion.finished else None
        return State.STAND

    def _enter(self, state: State, last: Targets) -> None:
        if state is State.RELAX:
            self.hold(last)
        elif state is State.LIE:
            self._lie(last)
        elif state is State.GET_UP:
            self.motion = self._get_up(last)
        elif state is State.POLICY and self._policies.policy is not None:
            self.motion = PolicyMotion(self._policies.policy, last, EASE_TIME)
        elif self.motion is not self._walk:
            self._stand(last)
        self.state = state

    def _advance_fault(self, last: Targets) -> None:
        if self._reaction is Reaction.LIE_DOWN:
            if self.motion is not self._lie_down and self.motion.settled:
                self._lie(last)
        elif self._reaction is Reaction.STAND:
            if isinstance(self.motion, PolicyMotion):
                self._stand(last)
            self._stand_after_blend()

    def _stand_after_blend(self) -> None:
        """Hand over to the gait once the robot has stood up."""
        up = self.state is State.STAND or self._reaction is Reaction.STAND
        if up and isinstance(self.motion, Blend) and self.motion.finished:
            self._generator.reset()
            self.motion = self._walk

    def _lie(self, last: Targets) -> None:
        if self.motion is not self._lie_down:
            self.motion = self._lie_down = self._blend(last, self._poses.lying(last))

    def _get_up(self, last: Targets) -> GetUp:
        self._generator.others = self._poses.with_arm(last)
        return GetUp(
            self._poses.robot,
            last,
            folded=self._poses.lying(last),
            standing=self._generator.stand_targets,
            swings=self._parameters.get_up_swings,
        )

    def _stand(self, last: Targets) -> None:
        self._generator.others = self._poses.with_arm(last)
        self.motion = self._blend(last, self._generator.stand_targets)

    def _blend(self, start: Targets, end: Targets) -> Blend:
        return Blend(start, end, self._parameters.blend_speed, self._parameters.blend_time)
