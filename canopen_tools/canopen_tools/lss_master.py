# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Master of the layer setting services: finds devices, gives them node id and bit rate (CiA 305).

It has no thread, clock or I/O of its own: coroutines of a scheduler send through a function and
wait for what :meth:`LssMaster.receive` is handed.
"""

from __future__ import annotations

from collections.abc import Callable

from arm_canopen import Scheduler
from canopen_core import LssError
from canopen_core.can import Frame
from canopen_core.standard import lss, NODE_ID_MAX, NODE_ID_MIN, UNCONFIGURED

TIMEOUT = 0.5  # [s] for an answer; storing may take some time
SCAN_TIMEOUT = 0.05  # [s] for an answer to a step of fast scan, whose absence means something
SCAN_ATTEMPTS = 3
SETTLE = 0.01  # [s] without another answer, after which all devices have answered
PARTS = ('vendor id', 'product code', 'revision number', 'serial number')
ERROR_TEXTS: dict[int, str] = {1: 'not supported by the device', 255: 'an error of its own'}
"""Error codes of configuration services (CiA 305, 6.4)."""


class LssMaster:
    """Speaks to the LSS slaves of a bus, one service at a time."""

    def __init__(
        self,
        scheduler: Scheduler,
        send: Callable[[Frame], None],
        *,
        timeout: float = TIMEOUT,
        scan_timeout: float = SCAN_TIMEOUT,
    ) -> None:
        """Time-outs in [s]: the longest of an answer, and of a step of fast scan at first."""
        self.answers: list[lss.Message] = []  # answers since the last request
        self._scheduler = scheduler
        self._send = send
        self._timeout = timeout
        self._scan_timeout = scan_timeout
        self._expected: frozenset[int] = frozenset()
        self._last = 0.0

    def receive(self, frame: Frame) -> None:
        """Process a frame from the bus; others than LSS answers are ignored."""
        if frame.can_id != lss.RESPONSE or frame.is_extended or frame.is_remote:
            return
        message = lss.decode(frame.data)
        if message is not None and message.command in self._expected:
            self.answers.append(message)
            self._last = max(self._scheduler.now, frame.timestamp)

    def switch_all(self, state: lss.State) -> None:
        """Switch every device to a state; none answers."""
        self._put(lss.with_bytes(lss.Command.SWITCH_GLOBAL, state))

    async def select(self, address: lss.Address) -> None:
        """Switch the device of an address to the configuration state.

        Raises:
            LssError: No device has this address.
        """
        for part, number in enumerate(address):
            self._put(
                lss.with_number(lss.Command.SELECT_VENDOR + part, number),
                lss.Command.SELECTED,
            )
        if not await self._answered(self._timeout):
            raise LssError(f'no device has the LSS address {address}')

    async def has_unconfigured(self) -> bool:
        """Return whether there is a device without a node id."""
        self._put(
            lss.with_bytes(lss.Command.IDENTIFY_UNCONFIGURED),
            lss.Command.UNCONFIGURED_IDENTIFIED,
        )
        return await self._answered(self._scan_timeout)

    async def fast_scan(self) -> lss.Address | None:
        """Find a device without a node id, and switch it to the configuration state.

        Each bit of its address is tested: silence means that it is set. Of several devices the
        one with the lowest number is found; the next call finds the next one. An answer that
        comes too late spoils the search, which is then made again with twice the time.

        Returns:
            Its address; None when no device without a node id is left in the waiting state.

        Raises:
            LssError: A device ended to answer in between, each time.
        """
        timeout, attempts = self._scan_timeout, 1
        while attempts < SCAN_ATTEMPTS:
            try:
                return await self._search(timeout)
            except LssError:
                await self._scheduler.timer(timeout)  # until the last late answer has passed
            timeout *= 2
            attempts += 1
        return await self._search(timeout)

    async def _search(self, timeout: float) -> lss.Address | None:
        if not await self._scan(lss.FastScan(), self._timeout):
            return None
        numbers = []
        for part in range(len(PARTS)):
            number = 0
            for bit in reversed(range(lss.ADDRESS_BITS)):
                if not await self._scan(lss.FastScan(number, bit, part, part), timeout):
                    number |= 1 << bit
            following = (part + 1) % len(PARTS)
            if not await self._scan(lss.FastScan(number, 0, part, following), timeout):
                raise LssError(
                    f'the device that was being scanned no longer answers ({PARTS[part]} '
                    f'0x{number:08X}); is it slower than {timeout * 1e3:g} ms?'
                )
            numbers.append(number)
        return lss.Address(*numbers)

    async def inquire_address(self) -> lss.Address:
        """Query the device in the configuration state for its address.

        Raises:
            LssError: None answers, or several do.
        """
        numbers = []
        for part, title in enumerate(PARTS):
            message = lss.with_bytes(lss.Command.INQUIRE_VENDOR + part)
            numbers.append((await self._only_answer(message, title)).number)
        return lss.Address(*numbers)

    async def inquire_node_id(self) -> int:
        """Query the device in the configuration state for its node id; 255 for none.

        Raises:
            LssError: None answers, or several do.
        """
        message = lss.with_bytes(lss.Command.INQUIRE_NODE_ID)
        return (await self._only_answer(message, 'node id')).byte

    async def set_node_id(self, node_id: int) -> None:
        """Give the device in the configuration state a node id from its next reset on; 255: none.

        Raises:
            LssError: It refuses the id, or none answers, or several do.
        """
        if not NODE_ID_MIN <= node_id <= NODE_ID_MAX and node_id != UNCONFIGURED:
            raise LssError(f'{node_id} is no node id; take 1 to 127, or 255 for none')
        message = lss.with_bytes(lss.Command.CONFIGURE_NODE_ID, node_id)
        await self._configure(message, f'node id {node_id}')

    async def set_bit_rate(self, bit_rate: int) -> None:
        """Give the device in the configuration state a bit rate of the standard table in [bit/s].

        Raises:
            LssError: It is not in the table, or is refused, or none answers, or several do.
        """
        for index, rate in lss.BIT_RATES.items():
            if rate == bit_rate:
                message = lss.with_bytes(
                    lss.Command.CONFIGURE_BIT_TIMING, lss.STANDARD_TABLE, index
                )
                await self._configure(message, f'{rate // 1000} kbit/s')
                return
        known = ', '.join(str(rate // 1000) for rate in lss.BIT_RATES.values())
        raise LssError(f'{bit_rate / 1000:g} kbit/s is no bit rate of LSS; take {known}')

    async def store(self) -> None:
        """Store the settings of the device in the configuration state.

        Raises:
            LssError: It cannot, or none answers, or several do.
        """
        await self._configure(lss.with_bytes(lss.Command.STORE), 'storing')

    def activate_bit_rate(self, delay: float) -> None:
        """Activate the new bit rate of all devices in the configuration state; none answers.

        They are silent for delay [s] before and again after the switch, so that all others can
        switch, too.
        """
        milliseconds = round(delay * 1e3).to_bytes(2, 'little')
        self._put(lss.with_bytes(lss.Command.ACTIVATE_BIT_TIMING, *milliseconds))

    async def _scan(self, step: lss.FastScan, timeout: float) -> bool:
        self._put(step.message(), lss.Command.IDENTIFIED)
        return await self._answered(timeout)

    async def _configure(self, message: lss.Message, title: str) -> None:
        code = (await self._only_answer(message, title)).byte
        if code:
            raise LssError(f'{title}: {ERROR_TEXTS.get(code, "error")} (LSS error {code})')

    async def _only_answer(self, message: lss.Message, title: str) -> lss.Message:
        """Send a request, and make sure that it is one device that answers."""
        self._put(message, message.command)
        if not await self._answered(self._timeout):
            raise LssError(f'{title}: no device answers; none is in the configuration state')
        if len(self.answers) > 1:
            raise LssError(
                f'{title}: {len(self.answers)} devices answer; select one of them by its address'
            )
        return self.answers[0]

    async def _answered(self, timeout: float) -> bool:
        """Wait for an answer, and until no more follow.

        A late answer of a second device would be taken for one to the next request.
        """
        try:
            await self._scheduler.until(lambda: bool(self.answers), timeout)
        except TimeoutError:
            return False
        while (rest := self._last + SETTLE - self._scheduler.now) > 0.0:
            await self._scheduler.timer(rest)
        return True

    def _put(self, message: lss.Message, *expected: int) -> None:
        self.answers = []
        self._expected = frozenset(expected)
        self._send(Frame(lss.REQUEST, message.encode()))
