# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""bus.yml and EDS/DCF files -> a typed, checked model of a bus.

``load_bus`` reads a whole bus, ``load_eds`` one device description. Both collect everything that
is wrong and raise one ``ConfigError`` whose problems name file, line, key and remedy.
"""

from ..exceptions import Problem
from .drive_model import DriveConfig
from .eds import Eds, load_eds
from .identity import Identity
from .load import load_bus
from .master_model import MasterConfig
from .model import BusConfig, NodeConfig, PdoConfig, SdoWrite

__all__ = [
    'BusConfig',
    'DriveConfig',
    'Eds',
    'Identity',
    'MasterConfig',
    'NodeConfig',
    'PdoConfig',
    'Problem',
    'SdoWrite',
    'load_bus',
    'load_eds',
]
