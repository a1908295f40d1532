# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The typed model of the master."""

from __future__ import annotations

from dataclasses import dataclass, field

from .identity import ANY_DEVICE, Identity

HEARTBEAT_PERIOD = 0.2  # [s] not 0: by it alone devices notice that the master died


@dataclass(frozen=True, slots=True)
class MasterConfig:
    """The master's own settings.

    Attributes:
        node_id: CANopen node id, 1 to 127.
        name: Key in bus.yml; also the name of its ROS node.
        driver: Driver class as bus.yml names it.
        namespace: ROS namespace, empty for none.
        remappings: ROS remappings, from name to name.
        bitrate: Bit rate in [bit/s], for the bus load.
        sync_period: SYNC period in [s]; 0 sends none.
        sync_window: Time after SYNC within which synchronous PDOs are sent in [s]; 0 for no limit.
        sync_overflow: Highest SYNC counter value, 0 for a SYNC without counter.
        time_cob_id: 0x1012 of the master: CAN identifier of TIME, with bit 30 when it sends it.
        time_period: Period of TIME in [s]; 0 sends none.
        cycle_period: Period of the control cycle in [s]: that of SYNC, without one the shortest
            ``period`` of a device.
        heartbeat_producer: Period of the master's own heartbeat in [s]; 0 for none.
        heartbeat_timeout: How long a device that watches the master waits for its heartbeat in
            [s], for 0x1016; 0 when there is none.
        start: The master runs its cycle from the start; false waits for NMT start with SYNC and
            RPDOs.
        start_nodes: The master starts devices when they are booted.
        start_all_nodes: Devices are started by one broadcast, when all mandatory ones are booted.
        reset_all_nodes: The loss of a mandatory device resets all devices.
        stop_all_nodes: The loss of a mandatory device stops all devices.
        nmt_inhibit_time: Shortest time between two NMT commands in [s].
        emcy_inhibit_time: Shortest time between two EMCY frames of the master in [s].
        error_behavior: 0x1029 of the master by sub-index: what it does when it loses a device.
        identity: 0x1018 of the master, for the files of other tools.
        boot_time: How long mandatory devices may take to boot in [s]; 0 for no limit.
        boot_timeout: SDO timeout during boot in [s].
    """

    node_id: int
    name: str = 'master'
    driver: str = 'ros2_canopen::MasterDriver'
    namespace: str = ''
    remappings: dict[str, str] = field(default_factory=dict)
    bitrate: int = 1_000_000
    sync_period: float = 0.0
    sync_window: float = 0.0
    sync_overflow: int = 0
    time_cob_id: int = 0x100
    time_period: float = 0.0
    cycle_period: float = 0.01
    heartbeat_producer: float = HEARTBEAT_PERIOD
    heartbeat_timeout: float = 0.0
    start: bool = True
    start_nodes: bool = True
    start_all_nodes: bool = False
    reset_all_nodes: bool = False
    stop_all_nodes: bool = False
    nmt_inhibit_time: float = 0.0
    emcy_inhibit_time: float = 0.0
    error_behavior: dict[int, int] = field(default_factory=dict)
    identity: Identity = ANY_DEVICE
    boot_time: float = 0.0
    boot_timeout: float = 2.0

    @property
    def is_lifecycle(self) -> bool:
        """The master and its devices are lifecycle nodes."""
        return 'Lifecycle' in self.driver
