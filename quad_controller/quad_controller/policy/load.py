# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From a file to a policy that may be followed, or to a table that says why not."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
import time

from quad_description import FEET, ImuSample, JointSample, Quadruped, Targets

from ..exceptions import PolicyError
from ..gait.velocity import REST
from .check import check_answers, check_contract
from .contract.build import build_contract
from .contract.declared import read_declared
from .contract.document import ContractDocument, document_of
from .contract.files import read_contract_file
from .contract.mjlab import CONTRACT_KEY, read_metadata
from .contract.model import PolicyContract, Source
from .interface import PolicyInputs
from .network import Floats, Network, OnnxNetwork
from .options import ImuFrame, PolicyOptions
from .report import Report, Row
from .runner import PolicyRunner
from .statistics import STATISTICS_KEY

UPRIGHT = ImuSample((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 9.81))


@dataclass(frozen=True, slots=True)
class LoadedPolicy:
    """A policy that has passed."""

    runner: PolicyRunner  # what runs it
    contract: PolicyContract  # what it expects
    document: ContractDocument  # the contract, and where each of its values comes from
    report: Report  # the table of the check
    digest: str  # SHA-256 of its file, and of those that its weights lie in
    metadata: dict[str, str]  # what its file has, as it stands there

    def __str__(self) -> str:
        """Return everything for people."""
        lines = [f'policy {self.runner.name}', f'sha256 {self.digest}', str(self.report)]
        lines += [f'{path}: {value}  ({origin})' for path, value, origin in self.document.rows()]
        lines += [
            f'metadata {key}: {value}'
            for key, value in sorted(self.metadata.items())
            if key not in {CONTRACT_KEY, STATISTICS_KEY}
        ]
        return '\n'.join(lines)


def document_for(network: Network, options: PolicyOptions) -> ContractDocument:
    """Return all that is known of a policy's contract; what counts most lies on top.

    Args:
        network: The network, with what its file has.

    Raises:
        PolicyError: A file cannot be read, or a value of it.
    """
    document = read_metadata(network.metadata)
    if options.contract is not None:
        joints = document.values.get('joints') or ()
        document = read_contract_file(options.contract, joints).over(document)
    return _settings(document, options).over(document)


def _settings(document: ContractDocument, options: PolicyOptions) -> ContractDocument:
    """Return what parameters say of terms."""
    terms = document.values.get('observation', {}).get('terms', {})
    settings: dict[str, dict[str, object]] = {}
    for name, source, key, value in _term_settings(terms, options):
        if terms[name].get('source') == source.value:
            settings.setdefault(name, {})[key] = value
    if not settings:
        return ContractDocument({})
    return document_of({'observation': {'terms': settings}}, 'parameter')


def _term_settings(
    terms: dict[str, dict[str, object]], options: PolicyOptions
) -> Iterator[tuple[str, Source, str, object]]:
    for name in terms:
        if options.imu_frame is not ImuFrame.AUTO:
            yield name, Source.ANGULAR_VELOCITY, 'frame', options.imu_frame.value
        if options.phase_period:
            yield name, Source.PHASE, 'phase_period', options.phase_period


def load_policy(
    path: Path, robot: Quadruped, stand: Targets, options: PolicyOptions, period: float
) -> LoadedPolicy:
    """Load a policy and check it.

    Raises:
        PolicyError: It cannot be loaded or does not fit; the message has the table.
    """
    network = OnnxNetwork(path)
    return validate_policy(
        path.name,
        network,
        robot,
        stand,
        options=options,
        period=period,
        clock=time.perf_counter,
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
        clock: A monotonic clock in [s], to see how long it takes.

    Raises:
        PolicyError: It does not fit; the message has the table.
    """
    document = document_for(network, options)
    contract = build_contract(document)
    fit = check_contract(
        network,
        contract,
        robot,
        stand,
        document=document,
        declared=read_declared(network.metadata),
        hold_missing=options.hold_missing,
        period=period,
        servo=options.servo,
    )
    checked = _accepted(tuple(fit), f'policy {name} does not fit this robot')
    network.recur(contract.recurrence, contract.action.output)
    runner = PolicyRunner(name, network, contract, robot, options=options, period=period)
    standing, held = _observed(runner, stand), runner.in_its_order(stand)
    try:
        answers = check_answers(network, standing, contract, held, period=period, clock=clock)
        rows = (*checked.rows, *answers)
    except Exception as error:
        raise PolicyError(f'policy {name} cannot be run: {error}') from error
    report = _accepted(rows, f'policy {name} does not behave')
    return LoadedPolicy(runner, contract, document, report, network.digest, dict(network.metadata))


def _accepted(rows: tuple[Row, ...], verdict: str) -> Report:
    """Return the rows of a check as a report."""
    report = Report(rows)
    if report.refused:
        raise PolicyError(f'{verdict}:\n{report}', report.reason)
    return report


def _observed(runner: PolicyRunner, stand: Targets) -> Floats:
    """Return what a policy observes of a robot that stands."""
    runner.reset(stand)
    still = JointSample(stand, (0.0,) * len(stand))
    return runner.observe(PolicyInputs(still, UPRIGHT, REST, (0.0, 0.0, 0.0), (True,) * len(FEET)))
