# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The simulated slave: object dictionary, services and a drive behind them."""

from .device import Device
from .drive import Drive
from .host import DeviceHost
from .runner import DeviceRunner
from .servo import ServoModel

__all__ = ['Device', 'DeviceHost', 'DeviceRunner', 'Drive', 'ServoModel']
