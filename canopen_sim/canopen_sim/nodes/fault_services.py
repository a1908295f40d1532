# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Services by which people and tests let simulated devices misbehave."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import TimeoutError as FutureTimeoutError
from functools import partial
import re
import time
from typing import Any

from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

from arm_msgs.srv import InjectFault
from canopen_core import BusError

from ..deviations import Fault, FaultInjection, parse_fault, unknown
from ..device import Device
from ..runner import DeviceRunner

ANSWER_TIMEOUT = 5.0  # [s] the thread of the devices answers within milliseconds
POWER_CYCLE_TIME = 0.5  # [s] how long the power is off
ALL_FAULTS = 'none'  # instead of a fault: none shall go on
NOT_IN_NAMES = re.compile(r'[^A-Za-z0-9_]')

Work = Callable[[Device, float], str]


class FaultServices:
    """The services ``~/fault``, ``~/power_cycle`` and ``~/sto``, of all devices and of each."""

    def __init__(self, node: Node, runner: DeviceRunner, names: Mapping[str, int]) -> None:
        """Offer them; names are node ids by name."""
        self._node = node
        self._runner = runner
        self._names = dict(names)
        self._create('~', '')
        for name in self._names:
            self._create(f'~/{service_part(name)}', name)

    def _create(self, prefix: str, name: str) -> None:
        create = self._node.create_service
        create(InjectFault, f'{prefix}/fault', partial(self._on_fault, name))
        create(Trigger, f'{prefix}/power_cycle', partial(self._on_power_cycle, name))
        create(SetBool, f'{prefix}/sto', partial(self._on_sto, name))

    # message classes have no types
    def _on_fault(self, name: str, request: Any, response: Any) -> Any:  # noqa: ANN401
        def begin() -> str:
            work: Work = end_faults
            if request.fault != ALL_FAULTS:
                work = injecting(parse_fault(request.fault, request.settings, request.duration))
            return self._do(request.device or name, work)

        return self._answer(response, begin)

    def _on_power_cycle(self, name: str, _request: Any, response: Any) -> Any:  # noqa: ANN401
        injection = FaultInjection(Fault.POWER_OFF, duration=POWER_CYCLE_TIME)
        return self._answer(response, lambda: self._do(name, injecting(injection)))

    def _on_sto(self, name: str, request: Any, response: Any) -> Any:  # noqa: ANN401
        active = bool(request.data)
        return self._answer(response, lambda: self._do(name, partial(switch_sto, active)))

    def _do(self, name: str, work: Work) -> str:
        """Do something with a device, or with all, in their thread.

        Raises:
            ValueError: There is no such device, or it cannot do that.
        """
        node_ids = self._node_ids(name)

        def run() -> list[str]:
            now = time.monotonic()
            host = self._runner.host
            results = [work(host.device(node_id), now) for node_id in node_ids]
            return list(dict.fromkeys(results))

        results = self._runner.call(run).result(ANSWER_TIMEOUT)
        who = f'{len(node_ids)} devices' if len(node_ids) != 1 else name or next(iter(self._names))
        return f'{who}: {"; ".join(results)}'

    def _node_ids(self, name: str) -> list[int]:
        if not name:
            return list(self._names.values())
        if name in self._names:
            return [self._names[name]]
        numbers = {str(node_id): node_id for node_id in self._names.values()}
        if name in numbers:
            return [numbers[name]]
        raise ValueError(unknown('device', name, self._names))

    def _answer(self, response: Any, work: Callable[[], str]) -> Any:  # noqa: ANN401
        try:
            response.message = work()
            response.success = True
        except (ValueError, FutureTimeoutError, BusError) as error:
            response.message = str(error) or 'the simulated devices do not run'
            response.success = False
        logger = self._node.get_logger()
        # two calls, as rclpy allows one severity to each place in the code
        if response.success:
            logger.info(response.message)
        else:
            logger.warning(response.message)
        return response


def service_part(name: str) -> str:
    """Return a device's name as a part of a ROS name (REP 144 has letters, digits and ``_``)."""
    part = NOT_IN_NAMES.sub('_', name)
    return part if part[:1].isalpha() else f'device_{part}'


def injecting(injection: FaultInjection) -> Work:
    """Return the work of beginning a fault."""

    def inject(device: Device, now: float) -> str:
        device.faults.inject(injection, now)
        return str(injection)

    return inject


def end_faults(device: Device, now: float) -> str:
    """End all faults of a device."""
    ended = [injection.fault.label for injection in device.faults.active]
    device.faults.end(now)
    return f'ended: {", ".join(ended)}' if ended else 'no fault was active'


def switch_sto(active: bool, device: Device, now: float) -> str:
    """Request safe torque off of a drive, or release it.

    Raises:
        ValueError: The device is not a drive.
    """
    if active:
        device.faults.inject(FaultInjection(Fault.STO), now)
        return 'STO is active, the motor has no torque'
    if not device.drives:
        raise ValueError(f'device {device.node_id} is not a drive')
    device.faults.end(now, Fault.STO)
    return 'STO is released'
