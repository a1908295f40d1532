# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The typed model of the master."""

from __future__ import annotations

from dataclasses import dataclass, field

from .identity import ANY_DEVICE, Identity

HEARTBEAT_PERIOD = 0.2  # [s] not 0: by it alone devices notice that the master died


@dataclass(frozen=True, slots=True)
class MasterConfig:
    """The master's own settings."""

    node_id: int
    name: str = 'master'  # key in bus.yml; also the name of its ROS node
    driver: str = 'ros2_canopen::MasterDriver'  # driver class as bus.yml names it
    namespace: str = ''  # ROS namespace, empty for none
    remappings: dict[str, str] = field(default_factory=dict)  # ROS remappings, from name to name
    bitrate: int = 1_000_000  # bit rate in [bit/s], for the bus load
    sync_period: float = 0.0  # SYNC period in [s]; 0 sends none
    # time after SYNC within which synchronous PDOs are sent in [s]; 0 for no limit
    sync_window: float = 0.0
    sync_overflow: int = 0  # highest SYNC counter value, 0 for a SYNC without counter
    # 0x1012 of the master: CAN identifier of TIME, with bit 30 when it sends it
    time_cob_id: int = 0x100
    time_period: float = 0.0  # period of TIME in [s]; 0 sends none
    # period of the control cycle in [s]: that of SYNC, without one the shortest ``period`` of a
    # device
    cycle_period: float = 0.01
    # period of the master's own heartbeat in [s]; 0 for none
    heartbeat_producer: float = HEARTBEAT_PERIOD
    # how long a device that watches the master waits for its heartbeat in [s], for 0x1016; 0 when
    # there is none
    heartbeat_timeout: float = 0.0
    # the master runs its cycle from the start; false waits for NMT start with SYNC and RPDOs
    start: bool = True
    start_nodes: bool = True  # the master starts devices when they are booted
    # devices are started by one broadcast, when all mandatory ones are booted
    start_all_nodes: bool = False
    reset_all_nodes: bool = False  # the loss of a mandatory device resets all devices
    stop_all_nodes: bool = False  # the loss of a mandatory device stops all devices
    nmt_inhibit_time: float = 0.0  # shortest time between two NMT commands in [s]
    emcy_inhibit_time: float = 0.0  # shortest time between two EMCY frames of the master in [s]
    # 0x1029 of the master by sub-index: what it does when it loses a device
    error_behavior: dict[int, int] = field(default_factory=dict)
    identity: Identity = ANY_DEVICE  # 0x1018 of the master, for the files of other tools
    boot_time: float = 0.0  # how long mandatory devices may take to boot in [s]; 0 for no limit
    boot_timeout: float = 2.0  # SDO timeout during boot in [s]

    @property
    def is_lifecycle(self) -> bool:
        """The master and its devices are lifecycle nodes."""
        return 'Lifecycle' in self.driver
