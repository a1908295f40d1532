# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""bus.yml and EDS/DCF files -> a typed, checked model of a bus, in three steps.

- ``read``: what stands in the files, with the place of each value.
- ``resolve``: which value counts, and the model that comes of it.
- ``model``: typed values in SI units, their checks, and the boot plan.

``model`` and ``sections`` declare each key of bus.yml, once.

``load_bus`` goes all three for a bus, ``load_eds`` reads one device description. Both collect
everything that is wrong and raise one ``ConfigError`` whose problems name file, line, key and
remedy; ``check_file`` reports them, and what works and was probably meant otherwise.
"""

from ..exceptions import Problem
from .load import check_file, load_bus
from .model import (
    BusConfig,
    DriveConfig,
    Identity,
    MasterConfig,
    NodeConfig,
    PdoConfig,
    SdoWrite,
)
from .read.eds import Eds, load_eds

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
    'check_file',
    'load_bus',
    'load_eds',
]
