# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""All devices of a bus.yml, and simulated in this process without ROS."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from arm_canopen.config import BusConfig, load_bus, rate_units, reported_increments
from canopen_core import CanopenError
from canopen_core.can import open_bus

from .host import DeviceHost
from .node_id_check import NodeIdCheck
from .objects.parameter_storage import ParameterMemory
from .runner import DeviceRunner

NO_POSITIONS: Mapping[str, float] = {}


def add_devices(
    host: DeviceHost,
    bus: BusConfig,
    positions: Mapping[str, float] = NO_POSITIONS,
    memory: Callable[[int], ParameterMemory] | None = None,
) -> None:
    """Add the devices of a bus to a host, switched off.

    Positions are where axes stand at the start, by name, in the units of bus.yml [rad or m], as
    their absolute encoders report it; the others report 0 increments. ``memory`` makes what a
    device keeps without power, by node id.

    Raises:
        CanopenError: The bus has no such axis, or it cannot report such a position.
    """
    if unknown := [name for name in positions if name not in bus.joints]:
        known = ', '.join(bus.joints) or 'none'
        raise CanopenError(f'positions: no drive {unknown[0]!r} in {bus.file}; drives: {known}')
    for node in bus.nodes:
        axes = node.axes if node.is_drive else ()
        device = host.add(
            node.node_id,
            node.dictionary,
            memory=None if memory is None else memory(node.node_id),
            rate_units={axis.channel: rate_units(bus, node, axis) for axis in axes},
        )
        drives = {drive.number: drive for drive in device.drives}
        for axis in axes:
            if axis.name not in positions:
                continue
            if axis.channel not in drives:
                raise CanopenError(f'positions: the EDS of {node.name} has no axis {axis.name}')
            try:
                increments = reported_increments(bus, node, axis, positions[axis.name])
            except ValueError as error:
                raise CanopenError(f'positions: {error}') from error
            drives[axis.channel].count_from(increments)


@contextmanager
def simulated_devices(
    bus_config: str | Path, bus: str = 'auto', positions: Mapping[str, float] = NO_POSITIONS
) -> Iterator[DeviceRunner]:
    """Simulate the devices of a bus.yml on a bus, in a thread that ends with the context.

    Args:
        bus_config: The bus.yml.
        bus: Name of the bus, as for :func:`canopen_core.can.open_bus`.
        positions: Where drives stand at the start, by name, in the units of bus.yml [rad or m].

    Yields:
        What runs them; ``runner.call`` gets at ``runner.host.devices``.

    Raises:
        ConfigError: The bus.yml or an EDS is wrong.
        BusError: The bus cannot be opened.
        CanopenError: The bus has no such drive, or it cannot report such a position; or devices
            with these node ids are on it already.
    """
    config = load_bus(bus_config)
    with open_bus(bus) as can:
        runner = DeviceRunner(can)
        add_devices(runner.host, config, positions)
        NodeIdCheck(can, [device.node_id for device in runner.host.devices]).finish()
        runner.start()
        try:
            yield runner
        finally:
            runner.stop()
