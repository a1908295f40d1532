# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What can be learned, as data: environment, contract, what differs, and how it is judged."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
import shutil

from comparison import best, compare, table
from contract_env import (
    ContractEnv,
    get_up_contract,
    get_up_env,
    taught_get_up_env,
    taught_walking_env,
    TaughtEnv,
    walking_contract,
    walking_env,
)
from get_up_trials import drop_table, is_better, is_gentle, stand_share, STRAIGHT, try_drops
from progress import Progress
from trained_contract import Values

from quad_controller.gait.parameters import LOW_AND_WIDE
from quad_controller.policy_check.main import run as check_policy
from quad_controller.policy_check.trial import Candidate, shipped_walkers
from quad_description import Quadruped
from quad_sim.env import Randomization

CHECKED_WALKS = ((0.2, 0.0, 0.3), (0.0, 0.1, 0.0), (-0.15, 0.0, -0.5))
"""Velocities with which check_policy lets it walk: x, y in [m/s], yaw in [rad/s]."""
GAIT, LOW_GAIT = 'gait', 'gait, low and wide'


@dataclass(frozen=True, slots=True)
class Effort:
    """How much is tried before a policy is judged.

    Attributes:
        way: Time of each way that it walks in [s].
        drops: How often it has to get up.
    """

    way: float = 15.0
    drops: int = 300


Policies = Mapping[str, Path]
"""Files of what was made, by their names."""


@dataclass(frozen=True, slots=True)
class Teaching:
    """What is imitated before practice.

    Attributes:
        make: Makes an environment whose observations end with the teacher's actions.
        kind: How the imitation is made, for people.
    """

    make: Callable[[Randomization], TaughtEnv]
    kind: str


@dataclass(frozen=True, slots=True)
class Task:
    """A task.

    Attributes:
        description: What the policy does, for people.
        make: Makes an environment to practise in.
        contract: Returns the contract of a policy for a robot, made in some way.
        kind: How practice makes it, for people.
        teaching: What is imitated first.
        randomization: What differs in the end.
        ends_with_a_fall: An episode does.
        deviation: Of the actions that are tried at the beginning of practice.
        judge: Compares what was made with what there is; writes figures and the better policy
            into a folder, and returns the exit code.
    """

    description: str
    make: Callable[[Randomization], ContractEnv]
    contract: Callable[[Quadruped, str], Values]
    kind: str
    teaching: Teaching
    randomization: Randomization
    ends_with_a_fall: bool
    deviation: float
    judge: Callable[[Path, Policies, Progress, Effort], int]


def judge_walking(folder: Path, policies: Policies, progress: Progress, effort: Effort) -> int:
    """Compare what was made with the gait and what is shipped; check the better one.

    Args:
        folder: For figures, and the policy that is better.
        policies: Those that were made.
        progress: Says what is found.
        effort: How much is tried.

    Returns:
        What check_policy returns.
    """
    progress.say('comparing ...')
    walkers = {GAIT: Candidate(), LOW_GAIT: Candidate(gait=LOW_AND_WIDE)}
    walkers |= shipped_walkers() | {name: Candidate(path) for name, path in policies.items()}
    compared = compare(walkers, effort.way)
    text = table(compared)
    (folder / 'figures.txt').write_text(f'{text}\n', encoding='utf-8')
    chosen = best({name: compared[name] for name in policies})
    path = folder / 'walk.onnx'
    shutil.copyfile(policies[chosen], path)
    code = 0
    for walk in CHECKED_WALKS:
        progress.say(f'check_policy {path} --walk {" ".join(map(str, walk))}')
        code = max(code, check_policy([str(path), '--walk', *map(str, walk)]))
    progress.say(text)
    verdict = 'accepted' if code == 0 else 'refused'
    progress.say(f'{path} is what {chosen} made; check_policy: {verdict}')
    return code


def judge_getting_up(folder: Path, policies: Policies, progress: Progress, effort: Effort) -> int:
    """Compare what was made with who goes to the stand pose straight, from the same drops.

    Args:
        folder: For figures, and the policy that stands most often.
        policies: Those that were made.
        progress: Says what is found.
        effort: How much is tried.

    Returns:
        0 when it is better and gentle to the servos, and check_policy accepts its file.
    """
    progress.say('dropping ...')
    tried = try_drops({STRAIGHT: None, **policies}, effort.drops)
    text = drop_table(tried)
    (folder / 'figures.txt').write_text(f'{text}\n', encoding='utf-8')
    chosen = max(policies, key=lambda name: stand_share(tried[name]))
    path = folder / 'getup.onnx'
    shutil.copyfile(policies[chosen], path)
    progress.say(f'check_policy {path}')
    code = check_policy([str(path)])
    progress.say(text)
    reasons = [] if code == 0 else ['check_policy refuses it']
    if not is_better(tried[chosen], tried[STRAIGHT]):
        reasons.append(f'it does not stand more often than who goes {STRAIGHT}')
    if not is_gentle(tried[chosen]):
        reasons.append('its servos are at their limits for too long')
    verdict = '; '.join(reasons) or 'accepted'
    progress.say(f'{path} is what {chosen} made: {verdict}')
    return 1 if reasons else 0


TASKS = {
    'walk': Task(
        description='walks as commanded; compared with the gait',
        make=walking_env,
        contract=walking_contract,
        kind='imitation of the trot, then PPO (quad_sim/Walk-v0, firm servos)',
        teaching=Teaching(
            taught_walking_env, 'imitation of the trot (DAgger in quad_sim/Walk-v0, firm servos)'
        ),
        randomization=Randomization(
            friction=(0.35, 1.3), trunk_mass=(0.9, 1.3), kick=(-1.6, 1.6), kick_interval=2.0
        ),
        ends_with_a_fall=True,
        deviation=0.18,  # 0.05 rad
        judge=judge_walking,
    ),
    'getup': Task(
        description=f'gets up after a fall; compared with who goes {STRAIGHT}',
        make=get_up_env,
        contract=get_up_contract,
        kind='imitation of poses, then PPO (quad_sim/GetUp-v0, firm servos)',
        teaching=Teaching(
            taught_get_up_env, 'imitation of poses (DAgger in quad_sim/GetUp-v0, firm servos)'
        ),
        randomization=Randomization(kick=(-0.3, 0.3)),
        ends_with_a_fall=False,
        deviation=0.3,  # 0.15 rad
        judge=judge_getting_up,
    ),
}
