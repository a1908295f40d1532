# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How a policy was run, kept with the recording of its steps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
import shutil

from rosbag_files import BagError, load_metadata, METADATA_FILE

from ..exceptions import ParameterError, PolicyError
from ..policy.options import PolicyOptions
from ..states.parameters import StateParameters

CONTRACT_FILE = 'contract.yaml'  # in the folder of a recording


@dataclass(frozen=True, slots=True)
class PolicyRun:
    """What the steps do not say, and the answers depend on."""

    # as it was named; empty for the gait, None where a recording does not say, as one that goes on
    policy: str | None
    options: PolicyOptions  # how it was run
    period: float  # of the control loop in [s]

    @property
    def about(self) -> Mapping[str, str]:
        """What is written down with the recording."""
        return {
            'policy': self.policy or '',
            'policy_options': self.options.to_json(),
            'period': repr(self.period),
        }

    def keep_contract(self, folder: Path) -> str:
        """Copy the contract of the options, when there is one, into the folder of the recording.

        Returns:
            Why not; empty when all is well.
        """
        if self.options.contract is not None:
            try:
                shutil.copyfile(self.options.contract, folder / CONTRACT_FILE)
            except OSError as error:
                return f'the contract is not kept: {error}'
        return ''

    @classmethod
    def of(cls, recording: Path) -> PolicyRun:
        """Return that of a recording; what an older one does not say has its default.

        Raises:
            PolicyError: It cannot be read.
        """
        folder = recording if recording.is_dir() else recording.parent
        about: Mapping[str, str] = {}
        try:
            if (folder / METADATA_FILE).is_file():
                metadata = load_metadata(folder / METADATA_FILE)
                if recording in {folder, *(folder / file.path for file in metadata.files)}:
                    about = metadata.custom or {}
        except BagError as error:
            raise PolicyError(f'recording {recording}: {error}') from error
        contract = folder / CONTRACT_FILE
        kept = contract if contract.is_file() else None
        try:
            options = (
                PolicyOptions.from_json(about['policy_options'], kept)
                if 'policy_options' in about
                else PolicyOptions(contract=kept)
            )
            period = float(about.get('period', StateParameters().period))
        except (ParameterError, ValueError) as error:
            raise PolicyError(f'recording {recording}: {error}') from error
        return cls(about.get('policy'), options, period)
