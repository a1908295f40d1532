# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""All devices of a bus.yml simulated in this process, without ROS."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from arm_canopen import load_bus, open_bus

from .runner import DeviceRunner


@contextmanager
def simulated_devices(bus_config: str | Path, bus: str = 'auto') -> Iterator[DeviceRunner]:
    """Simulate the devices of a bus.yml on a bus, in a thread that ends with the context.

    Args:
        bus_config: The bus.yml.
        bus: Name of the bus, as for :func:`arm_canopen.open_bus`.

    Yields:
        What runs them; ``runner.call`` gets at ``runner.host.devices``.

    Raises:
        ConfigError: The bus.yml or an EDS is wrong.
        BusError: The bus cannot be opened.
    """
    config = load_bus(bus_config)
    with open_bus(bus) as can:
        runner = DeviceRunner(can)
        for node in config.nodes:
            runner.host.add(node.node_id, node.dictionary)
        runner.start()
        try:
            yield runner
        finally:
            runner.stop()
