# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How a policy is run, where its file leaves that open."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
import json
from pathlib import Path
from typing import Any

from ..exceptions import ParameterError
from ..settings import check_settings, setting, settings_of, switch
from .gains import ServoResponse


class GravitySource(Enum):
    """Where the direction of gravity is taken from.

    ``BLEND`` is the orientation, drawn a little to the accelerometer while that feels about 1 g.
    """

    ACCEL = 'accel'
    EULER = 'euler'
    BLEND = 'blend'


class ImuFrame(Enum):
    """Frame in which the policy expects the angular velocity; ``AUTO`` is that of its contract."""

    AUTO = 'auto'
    BASE = 'base'
    YAWED = 'yawed'


@dataclass(frozen=True, slots=True)
class PolicyOptions:
    """Options of the runner."""

    # file whose values count before those in the policy's own; None for none
    contract: Path | None = None
    phase_period: float = setting(0.0, 0.0, 10.0, '[s]; 0: that of the contract')
    imu_frame: ImuFrame = switch(  # noqa: RUF009  # a field
        ImuFrame.AUTO,
        'frame of the angular velocity; yawed: turned by 180 degrees; auto: that of the file',
    )
    gravity_source: GravitySource = switch(  # noqa: RUF009  # a field
        GravitySource.BLEND, 'of the direction of gravity'
    )
    hold_missing: bool = switch(
        False, 'joints of the policy that the robot lacks count as being at their default'
    )
    soft_limits: float = setting(
        0.9, 0.1, 1.0, "share of a joint's range that its targets may use"
    )
    low_pass: float = setting(0.0, 0.0, 100.0, 'cut-off of a filter of its targets [Hz]; 0: none')
    # how the servos of the robot follow, to be compared with those of the training; None when
    # nobody knows
    servo: ServoResponse | None = None

    def __post_init__(self) -> None:
        """Refuse what makes no sense.

        Raises:
            ParameterError: A value is outside of its range.
        """
        check_settings(self, 'policy_')

    def to_json(self) -> str:
        """Return all that decides about observations and targets, but the contract's file."""
        values = {name: getattr(self, name) for name, *_ in settings_of(self)}
        return json.dumps(values, default=lambda choice: choice.value)

    @classmethod
    def from_json(cls, text: str, contract: Path | None = None) -> PolicyOptions:
        """Return what :meth:`to_json` wrote, with a file of the contract.

        Raises:
            ParameterError: It is something else.
        """
        try:
            values: dict[str, Any] = json.loads(text)
            for name, default, *_ in settings_of(cls):
                if name in values and isinstance(default, Enum):
                    values[name] = type(default)(values[name])
            return cls(contract=contract, **values)
        except (ValueError, TypeError, AttributeError) as error:
            raise ParameterError(f'options of a policy {text!r}: {error}') from error
