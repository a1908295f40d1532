# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Loads a policy file and checks it; the result is a runnable policy or a table of reasons."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
import re

from quad_description import FEET, ImuSample, JointSample, Quadruped, Targets

from ..exceptions import PolicyError
from .check import check_answers, check_contract
from .contract.build import build_contract
from .contract.configs import read_playground, read_rl_sar
from .contract.document import ContractDocument, document_of, known, load_yaml, Values
from .contract.isaac_lab import read_deploy, read_env
from .contract.mjlab import CONTRACT_KEY, read_metadata
from .contract.model import PolicyContract, Source
from .network import Floats, OnnxNetwork
from .observation import Situation
from .options import ImuFrame, PolicyOptions, Report, Row
from .runner import PolicyRunner

SHIPPED = Path(__file__).parents[1] / 'policies'
UPRIGHT = ImuSample((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 9.81))


def read_contract_file(path: Path, joints: Sequence[str] = ()) -> ContractDocument:
    """Read a contract from our own YAML or from a training tool's file.

    Args:
        joints: Joint names in the policy's order, if already known.

    Raises:
        PolicyError: The file cannot be read, or has an unknown format.
    """
    try:
        text = path.read_text(encoding='utf-8')
    except (OSError, UnicodeDecodeError) as error:
        raise PolicyError(f'contract {path}: {error}') from error
    values = load_yaml(text, path.name)
    try:
        return _read(values, path, joints)
    except (AttributeError, IndexError, KeyError, TypeError, ValueError, re.error) as error:
        if isinstance(error, PolicyError):
            raise
        raise PolicyError(f'contract {path}: a value is not of its form: {error}') from error


def _read(values: Values, path: Path, joints: Sequence[str]) -> ContractDocument:
    keys = set(values)
    if {'step_dt', 'observations', 'actions'} <= keys:
        return read_deploy(values, path.name)
    if {'sim', 'decimation', 'observations'} <= keys:
        return read_env(values, path.name, joints)
    if 'ctrl_dt' in keys:
        return read_playground(values, path.name)
    inner = next(iter(values.values())) if len(values) == 1 else values
    if isinstance(inner, dict) and ({'observations', 'dt', 'joint_mapping'} & set(inner)):
        return read_rl_sar(values, path.name)
    if {'joints', 'observation', 'action', 'period', 'default_positions'} & keys:
        return document_of(values, path.name)
    raise PolicyError(
        f'contract {path}: neither a contract of ours (joints, period, observation, action) nor '
        f'deploy.yaml, env.yaml, config.yaml of rl_sar or config.json of Playground; its keys: '
        f'{", ".join(map(str, sorted(keys, key=str)))}'
    )


@dataclass(frozen=True, slots=True)
class LoadedPolicy:
    """A policy that passed all checks."""

    runner: PolicyRunner  # what runs it
    contract: PolicyContract  # what it expects
    document: ContractDocument  # the contract, and where each of its values comes from
    report: Report  # the table of the check
    digest: str  # SHA-256 of its file, and of those that its weights lie in
    metadata: dict[str, str]  # what its file has, as it stands there

    def __str__(self) -> str:
        """Return a readable summary."""
        lines = [f'policy {self.runner.name}', f'sha256 {self.digest}', str(self.report)]
        lines += [f'{path}: {value}  ({origin})' for path, value, origin in self.document.rows()]
        lines += [
            f'metadata {key}: {value}'
            for key, value in sorted(self.metadata.items())
            if key != CONTRACT_KEY
        ]
        return '\n'.join(lines)


def document_for(network: OnnxNetwork, options: PolicyOptions) -> ContractDocument:
    """Return all known contract values of a policy; merge sources by precedence.

    Raises:
        PolicyError: A file or a value in it cannot be read.
    """
    document = read_metadata(network.metadata)
    if options.contract is not None:
        joints = document.values.get('joints') or ()
        document = read_contract_file(options.contract, joints).over(document)
    return _settings(document, options).over(document)


def _settings(document: ContractDocument, options: PolicyOptions) -> ContractDocument:
    """Return the contract values that parameters set."""
    terms = document.values.get('observation', {}).get('terms', {})
    values: dict[str, dict[str, object]] = {}
    if options.imu_frame is not ImuFrame.AUTO:
        values[Source.ANGULAR_VELOCITY.value] = {'frame': options.imu_frame.value}
    if options.phase_period:
        values[Source.PHASE.value] = {'phase_period': options.phase_period}
    found = {name: values.get(str(term.get('source'))) for name, term in terms.items()}
    return document_of(known(observation=known(terms=known(**found))), 'parameter')


def load_policy(
    policy: Path | OnnxNetwork,
    robot: Quadruped,
    stand: Targets,
    options: PolicyOptions,
    period: float,
) -> LoadedPolicy:
    """Load a policy and check it.

    Raises:
        PolicyError: It cannot be loaded or does not fit; the message has the table.
    """
    network = policy if isinstance(policy, OnnxNetwork) else OnnxNetwork(policy)
    document = document_for(network, options)
    contract = build_contract(document)
    fit = check_contract(
        network,
        contract,
        robot,
        stand,
        document=document,
        hold_missing=options.hold_missing,
        period=period,
        servo=options.servo,
    )
    checked = _accepted(tuple(fit), f'policy {network.name} does not fit this robot')
    network.recur(contract.recurrence, contract.action.output)
    runner = PolicyRunner(network, contract, robot, options=options, period=period)
    standing, held = _observed(runner, stand), runner.in_its_order(stand)
    try:
        answers = check_answers(network, standing, contract, held, period)
        rows = (*checked.rows, *answers)
    except Exception as error:
        raise PolicyError(f'policy {network.name} cannot be run: {error}') from error
    report = _accepted(rows, f'policy {network.name} does not behave')
    return LoadedPolicy(runner, contract, document, report, network.digest, dict(network.metadata))


def _accepted(rows: tuple[Row, ...], verdict: str) -> Report:
    """Collect the rows of a check into a report."""
    report = Report(rows)
    if report.refused:
        raise PolicyError(f'{verdict}:\n{report}', report.reason)
    return report


def _observed(runner: PolicyRunner, stand: Targets) -> Floats:
    """Return the policy's observation of a standing robot."""
    runner.reset(stand)
    still = JointSample(stand, (0.0,) * len(stand))
    contacts = (True,) * len(FEET)
    known = Situation(still, UPRIGHT, linear_velocity=(0.0, 0.0, 0.0), foot_contacts=contacts)
    return runner.observe(known)


def shipped_policies() -> dict[str, Path]:
    """Return the files of all shipped policies by name."""
    return {path.stem: path for path in sorted(SHIPPED.glob('*.onnx'))}


def find_policy(text: str) -> Path:
    """Return the file for a path, or for the name of a shipped policy.

    Raises:
        PolicyError: The text is neither.
    """
    path = Path(text).expanduser()
    if path.is_file():
        return path
    shipped = shipped_policies()
    if text in shipped:
        return shipped[text]
    raise PolicyError(
        f'policy {text!r} is neither a file nor shipped ({", ".join(shipped) or "none"})'
    )
