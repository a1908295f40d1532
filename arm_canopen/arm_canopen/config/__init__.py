# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""bus.yml and EDS/DCF files -> a typed, checked model of a bus, in three steps.

- ``read``: parses the files and keeps the line and key path of each value.
- ``resolve``: decides which value counts and builds the model.
- ``model``: typed values in SI units, their checks, and the boot plan.

``model`` and ``sections`` declare each key of bus.yml exactly once.

``load_bus`` runs all three steps for a bus, ``load_eds`` reads one device description. Both
collect all errors and raise one ``ConfigError`` whose problems name file, line, key and remedy;
``check_file`` reports the errors, and warns of settings that work but are probably unintended.
"""

from canopen_core.eds import load_eds

from .keys import HUNDRED_MICROSECONDS, KILOBIT, MICROSECONDS, MILLISECONDS
from .model import (
    BusConfig,
    DriveConfig,
    Identity,
    MasterConfig,
    NodeConfig,
    PdoConfig,
    RecoveryPolicy,
    SdoWrite,
)
from .model.boot_plan import (
    boot_writes,
    BootWrite,
    consumer_to_read,
    held_after_boot,
    HeldConsumers,
)
from .model.bus import Direction, IDENTITY_OBJECTS, RPDO, TPDO, U16_MAX
from .model.checks import check_bus, LoadEstimate, Report, Traffic
from .model.drive import FACTOR_ADDRESSES, FACTOR_OBJECTS, FactorGroup, NamedUnit, RPM, UNSET
from .model.drive_units import (
    ACCELERATION_KEY,
    AxisUnits,
    is_coarse,
    MOTION_OBJECTS,
    rate_units,
    reported_increments,
    UnitRule,
)
from .read.document import DEFAULT_DRIVE
from .resolve.bus import check_file, load_bus
from .resolve.pdos import eds_mapping, is_fixed, mapping_slots

__all__ = [
    'ACCELERATION_KEY',
    'DEFAULT_DRIVE',
    'FACTOR_ADDRESSES',
    'FACTOR_OBJECTS',
    'HUNDRED_MICROSECONDS',
    'IDENTITY_OBJECTS',
    'KILOBIT',
    'MICROSECONDS',
    'MILLISECONDS',
    'MOTION_OBJECTS',
    'RPDO',
    'RPM',
    'TPDO',
    'U16_MAX',
    'UNSET',
    'AxisUnits',
    'BootWrite',
    'BusConfig',
    'Direction',
    'DriveConfig',
    'FactorGroup',
    'HeldConsumers',
    'Identity',
    'LoadEstimate',
    'MasterConfig',
    'NamedUnit',
    'NodeConfig',
    'PdoConfig',
    'RecoveryPolicy',
    'Report',
    'SdoWrite',
    'Traffic',
    'UnitRule',
    'boot_writes',
    'check_bus',
    'check_file',
    'consumer_to_read',
    'eds_mapping',
    'held_after_boot',
    'is_coarse',
    'is_fixed',
    'load_bus',
    'load_eds',
    'mapping_slots',
    'rate_units',
    'reported_increments',
]
