# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Words that the page reads in /diagnostics, beside those of a robot's nodes, and its keys."""

from __future__ import annotations

from arm_canopen.master.remote_node import BootPhase
from arm_servo.teleop.keyboard_teleop import TOOL
from canopen_core.standard import DriveState, OperationMode
from quad_controller import MODES as QUAD_MODES
from quad_controller.states.modes import MOVING_STATES
from quad_teleop.key_map import MOVES
from robot_viewer.page.jog_panel import TWISTS
from robot_viewer.page.robot_page import GAITS, MODES, WALKS
from robot_viewer.robot_state import (
    BOOTING,
    ENABLED,
    FAULTY,
    FOLLOWS,
    MODE_SERVICES,
    NO_MODE,
    POSTURES,
)

ENDS = {BootPhase.WAITING, BootPhase.OPERATIONAL, BootPhase.FAILED}
"""Phases in which a device does not come by itself, or is there."""


def test_words_of_drives() -> None:
    """Each phase of a boot is one; a fault and a drive with torque are known by their titles."""
    assert set(BOOTING) == {phase.value for phase in BootPhase if phase not in ENDS}
    faults = DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE
    assert {state.title for state in faults} == FAULTY
    assert DriveState.OPERATION_ENABLED.title == ENABLED
    assert {NO_MODE, *MODE_SERVICES} <= {mode.title for mode in OperationMode}


def test_words_of_legs() -> None:
    """Modes that the page requests are modes; those with velocities are all of them."""
    assert {state.value for state in MOVING_STATES} == FOLLOWS
    assert {*POSTURES, *MODES.values(), *(f'gait:{gait}' for gait in GAITS)} <= set(QUAD_MODES)


def test_keys_are_those_of_the_terminals() -> None:
    """They move the same way."""
    for key, twist in TWISTS.values():
        jog = TOOL[key.removeprefix('Arrow').lower()]
        assert (*jog.linear, *jog.angular) == twist
    for key, velocity in WALKS.values():
        move = MOVES[key]
        assert [*map(signum, velocity)] == [move.x, move.y, move.yaw]


def signum(value: float) -> int:
    """Return 1, 0 or -1."""
    return (value > 0.0) - (value < 0.0)
