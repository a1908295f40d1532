# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
r"""Serial protocols of the XGO: tables, codecs, and a stream parser for either side.

The driver, the simulated robot, ``xgo_lib2`` and the protocol page all read these tables::

    robot = StreamParser(V1, HOST_KINDS)  # what a robot receives
    for frame in robot.feed(port.read(4096)):
        if frame.kind is Kind.READ and frame.address == Register.BATTERY:
            port.write(Frame(Kind.REPLY, frame.address, b'\x55').encode(V1))
"""

from .frame import (
    Access,
    checksum,
    Field,
    Frame,
    Function,
    HOST_KINDS,
    Kind,
    Model,
    ParserCounters,
    Protocol,
    ROBOT_KINDS,
    Scalar,
    Span,
    StreamParser,
)
from .tables import (
    ACTION_RESET,
    ALL_MOTORS,
    ANGLE_SPANS,
    ARM_MOTORS,
    BULK_READ_ORDER,
    Code,
    DEVELOPER,
    Fault,
    LEG_MOTORS,
    model_of_firmware,
    MOTOR_OF_JOINT,
    MOTOR_OF_REGISTER,
    MOTOR_ORDER,
    Refusal,
    Register,
    REGISTER_OF_MOTOR,
    scatter,
    slot_of,
    STATE,
    swap_floats,
    Torque,
    V1,
    V2,
)

PROTOCOLS = (V1, DEVELOPER, V2)  # in the order of probing: documented before assumed

__all__ = [
    'ACTION_RESET',
    'ALL_MOTORS',
    'ANGLE_SPANS',
    'ARM_MOTORS',
    'BULK_READ_ORDER',
    'DEVELOPER',
    'HOST_KINDS',
    'LEG_MOTORS',
    'MOTOR_OF_JOINT',
    'MOTOR_OF_REGISTER',
    'MOTOR_ORDER',
    'PROTOCOLS',
    'REGISTER_OF_MOTOR',
    'ROBOT_KINDS',
    'STATE',
    'V1',
    'V2',
    'Access',
    'Code',
    'Fault',
    'Field',
    'Frame',
    'Function',
    'Kind',
    'Model',
    'ParserCounters',
    'Protocol',
    'Refusal',
    'Register',
    'Scalar',
    'Span',
    'StreamParser',
    'Torque',
    'checksum',
    'model_of_firmware',
    'scatter',
    'slot_of',
    'swap_floats',
]
