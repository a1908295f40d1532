# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reads a contract from a file of any tool, by what stands in it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
import re

from ...exceptions import PolicyError
from . import isaac_lab, playground, rl_sar
from .document import ContractDocument, document_of, Values


def read_contract_file(path: Path, joints: Sequence[str] = ()) -> ContractDocument:
    """Read a file: our own YAML, or that of a training tool.

    Args:
        joints: Names of the joints in the policy's order, where they are known already.

    Raises:
        PolicyError: It cannot be read, or is none of them.
    """
    try:
        text = path.read_text(encoding='utf-8')
    except (OSError, UnicodeDecodeError) as error:
        raise PolicyError(f'contract {path}: {error}') from error
    values = isaac_lab.load_tagged(text, path.name)
    try:
        return _read(values, path, joints)
    except (AttributeError, IndexError, KeyError, TypeError, ValueError, re.error) as error:
        if isinstance(error, PolicyError):
            raise
        raise PolicyError(f'contract {path}: a value is not of its form: {error}') from error


def _read(values: Values, path: Path, joints: Sequence[str]) -> ContractDocument:
    keys = set(values)
    if {'step_dt', 'observations', 'actions'} <= keys:
        return isaac_lab.read_deploy(values, path.name)
    if {'sim', 'decimation', 'observations'} <= keys:
        return isaac_lab.read_env(values, path.name, joints)
    if 'ctrl_dt' in keys:
        return playground.read_config(values, path.name)
    inner = next(iter(values.values())) if len(values) == 1 else values
    if isinstance(inner, dict) and ({'observations', 'dt', 'joint_mapping'} & set(inner)):
        return rl_sar.read_config(values, path.name)
    if {'joints', 'observation', 'action', 'period', 'default_positions'} & keys:
        return document_of(values, path.name)
    raise PolicyError(
        f'contract {path}: neither a contract of ours (joints, period, observation, action) nor '
        f'deploy.yaml, env.yaml, config.yaml of rl_sar or config.json of Playground; its keys: '
        f'{", ".join(map(str, sorted(keys, key=str)))}'
    )
