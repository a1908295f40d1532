# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From a file to a policy that may be followed, or to a table that says why not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
import time

import numpy as np

from quad_description import ImuSample, JointSample, Quadruped, Targets

from ..exceptions import PolicyError
from ..gait.velocity import REST
from .check import check_answers, check_contract, Report
from .metadata import read_metadata
from .network import Network, OnnxNetwork
from .options import PolicyOptions
from .runner import PolicyRunner

UPRIGHT = ImuSample((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 9.81))


@dataclass(frozen=True, slots=True)
class LoadedPolicy:
    """A policy that has passed.

    Attributes:
        runner: What runs it.
        report: The table of the check.
        digest: SHA-256 of its file.
        metadata: What its file has, as it stands there.
    """

    runner: PolicyRunner
    report: Report
    digest: str
    metadata: dict[str, str]

    def __str__(self) -> str:
        """Return everything for people."""
        lines = [f'policy {self.runner.name}', f'sha256 {self.digest}', str(self.report)]
        lines += [f'{key}: {value}' for key, value in sorted(self.metadata.items())]
        return '\n'.join(lines)


def load_policy(
    path: Path, robot: Quadruped, stand: Targets, options: PolicyOptions, period: float
) -> LoadedPolicy:
    """Load a policy and check it.

    Args:
        path: An ONNX file.
        robot: The robot.
        stand: Where the gait stands [rad].
        options: How it shall be run.
        period: Time between two steps in [s].

    Raises:
        PolicyError: It cannot be loaded or does not fit; the message has the table.
    """
    network = OnnxNetwork(path)
    return validate_policy(
        path.name, network, robot, stand, options=options, period=period, clock=time.perf_counter
    )


def validate_policy(
    name: str,
    network: Network,
    robot: Quadruped,
    stand: Targets,
    *,
    options: PolicyOptions,
    period: float,
    clock: Callable[[], float],
) -> LoadedPolicy:
    """Check a network as a policy.

    Args:
        name: How it is called in messages.
        network: What answers.
        robot: The robot.
        stand: Where the gait stands [rad].
        options: How it shall be run.
        period: Time between two steps in [s].
        clock: A monotonic clock in [s], to see how long it takes.

    Raises:
        PolicyError: It does not fit; the message has the table.
    """
    metadata = read_metadata(network.metadata)
    report = Report(
        tuple(check_contract(network, metadata, robot, stand, options=options, period=period))
    )
    if report.refused:
        raise PolicyError(f'policy {name} does not fit this robot:\n{report}', report.reason)
    runner = PolicyRunner(name, network, metadata, robot, options)
    runner.reset(stand)
    still = JointSample(stand, (0.0,) * len(stand))
    standing = runner.observe(still, UPRIGHT, REST).copy()
    scale = np.array(metadata.action_scale, np.float32)
    try:
        answers = tuple(check_answers(network.run, standing, scale, period, clock))
    except Exception as error:
        raise PolicyError(f'policy {name} cannot be run: {error}') from error
    report = Report((*report.rows, *answers))
    if report.refused:
        raise PolicyError(f'policy {name} does not behave:\n{report}', report.reason)
    return LoadedPolicy(runner, report, network.digest, dict(network.metadata))
