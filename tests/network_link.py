# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A link between two hosts with the faults of a radio: delay, jitter, loss, no multicast, a cut.

Two tap devices, and a thread that carries Ethernet frames from one to the other. It does what
``tc netem`` does, for kernels that have none.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
import fcntl
import heapq
import os
import random
import select
import struct
import threading
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import TracebackType

    from typing_extensions import Self

_DEVICE = '/dev/net/tun'
_TUNSETIFF = 0x400454CA  # linux/if_tun.h
_IFF_TAP, _IFF_NO_PI = 0x0002, 0x1000
_FRAME_SIZE = 65536  # [byte] longest frame, segmentation left to the kernel
_ARP = b'\x08\x06'  # EtherType; a link without multicast still resolves addresses
_SEED = 1


@dataclass(frozen=True, slots=True)
class Condition:
    """What a link does to frames.

    Attributes:
        delay: Of each frame, one way, in [s].
        jitter: Greatest further delay, evenly distributed, in [s]; frames keep their order.
        loss: Share of the frames that are lost.
        multicast: Whether multicast gets through.
        cut: Whether nothing does.
    """

    delay: float = 0.0
    jitter: float = 0.0
    loss: float = 0.0
    multicast: bool = True
    cut: bool = False


class Link:
    """The link; it carries frames within a ``with`` statement.

    Attributes:
        names: Names of its two devices, to be moved to the hosts.
        condition: What it does to frames from now on; may be replaced at any time.
    """

    def __init__(self, mark: str) -> None:
        """Make the devices.

        Args:
            mark: Makes their names unique on this machine, up to 10 characters.

        Raises:
            OSError: This machine does not allow it.
        """
        self.condition = Condition()
        self.names = (f'tap-{mark}a', f'tap-{mark}b')
        self._random = random.Random(_SEED)  # no secrets
        with ExitStack() as stack:
            self._ends = tuple(_open_tap(stack, name) for name in self.names)
            self._wake, self._stop = os.pipe()
            stack.callback(os.close, self._wake)
            self._stack = stack.pop_all()
        self._thread = threading.Thread(target=self._carry, name='link')

    def _carry(self) -> None:
        """Take frames at either end, and give them to the other one when they are due."""
        other = dict(zip(self._ends, reversed(self._ends), strict=True))
        waiting: list[tuple[float, int, int, bytes]] = []  # [s], order, end, frame
        last = dict.fromkeys(self._ends, 0.0)  # [s] when the last frame of an end is due
        count = 0
        while True:
            timeout = max(0.0, waiting[0][0] - time.monotonic()) if waiting else None
            ready, _, _ = select.select([*self._ends, self._wake], [], [], timeout)
            if self._wake in ready:
                return
            now = time.monotonic()
            for end in ready:
                frame, condition = os.read(end, _FRAME_SIZE), self.condition
                if self._is_lost(frame, condition):
                    continue
                due = now + condition.delay + condition.jitter * self._random.random()
                last[end] = due = max(due, last[end])
                count += 1
                heapq.heappush(waiting, (due, count, other[end], frame))
            while waiting and waiting[0][0] <= now:
                _, _, end, frame = heapq.heappop(waiting)
                if not self.condition.cut:
                    _write(end, frame)

    def _is_lost(self, frame: bytes, condition: Condition) -> bool:
        if condition.cut or self._random.random() < condition.loss:
            return True
        return not condition.multicast and bool(frame[0] & 1) and frame[12:14] != _ARP

    def __enter__(self) -> Self:
        """Begin to carry frames."""
        self._thread.start()
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """End, and remove the devices."""
        os.close(self._stop)
        self._thread.join()
        self._stack.close()


def _open_tap(stack: ExitStack, name: str) -> int:
    end = os.open(_DEVICE, os.O_RDWR | os.O_NONBLOCK)
    stack.callback(os.close, end)
    request = struct.pack('16sH22x', name.encode(), _IFF_TAP | _IFF_NO_PI)
    fcntl.ioctl(end, _TUNSETIFF, request)
    return end


def _write(end: int, frame: bytes) -> None:
    try:
        os.write(end, frame)
    except OSError:  # the device is down: the frame is lost, as on a cable
        return
