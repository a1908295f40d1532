# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""An EDS that types a position, velocity or torque without a sign is refused where it is used."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from config_cases import added
from config_samples import BUS, DRIVE_ROWS, eds_text, errors_of, load_text, write_bus
import pytest

MAPPED = {
    0x607A: 'rpdo: {1: {mapping: [{index: 0x6040}, {index: 0x607A}]}}',
    0x60FF: 'rpdo: {1: {mapping: [{index: 0x6040}, {index: 0x60FF}]}}',
    0x6064: 'tpdo: {1: {mapping: [{index: 0x6041}, {index: 0x6064}]}}',
    0x606C: 'tpdo: {1: {mapping: [{index: 0x6041}, {index: 0x606C}]}}',
}


def unsigned(index: int) -> str:
    """Return an EDS that types an object as UNSIGNED32."""
    return eds_text(replace(row, data_type=7) if row.index == index else row for row in DRIVE_ROWS)


@pytest.mark.parametrize('index', MAPPED, ids=hex)
def test_an_unsigned_position_or_velocity_in_a_pdo_is_refused(tmp_path: Path, index: int) -> None:
    """With the PDO, the object and its type; it could not carry half of the motion."""
    path = write_bus(tmp_path, added('joint1', MAPPED[index]), eds=unsigned(index))
    (problem,) = errors_of(path)
    assert problem.key.startswith('nodes.joint1.')
    assert f'0x{index:04X}:00 as UNSIGNED32' in problem.message
    assert 'DataType' in problem.remedy
    assert not errors_of(write_bus(tmp_path, added('joint1', MAPPED[index])))


@pytest.mark.parametrize('index', MAPPED, ids=hex)
def test_one_that_no_pdo_carries_is_left_alone(tmp_path: Path, index: int) -> None:
    """Nobody commands or reads it in the cycle."""
    assert not errors_of(write_bus(tmp_path, BUS, eds=unsigned(index)))


def test_a_proxy_may_type_its_objects_as_it_likes(tmp_path: Path) -> None:
    """The profile of drives does not count for it."""
    text = added('joint1', f'driver: "ros2_canopen::ProxyDriver"\n{MAPPED[0x607A]}')
    assert load_text(tmp_path, text, eds=unsigned(0x607A)).nodes
