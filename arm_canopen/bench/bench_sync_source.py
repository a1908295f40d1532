# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How evenly SYNC comes: from absolute deadlines in Python, and from the kernel's BCM.

The broadcast manager of SocketCAN sends a cyclic frame by a timer of the kernel; its loop-back
could start the cycle. It is measured where there is a vcan0 that is up.
"""

from __future__ import annotations

from collections.abc import Callable
import select
import socket
import struct
import time

PERIODS = (0.010, 0.004)  # [s]
SECONDS = 5.0
INTERFACE = 'vcan0'
SYNC = 0x080
# linux/can/bcm.h
TX_SETUP, TX_DELETE = 1, 2
SETTIMER, STARTTIMER = 0x0001, 0x0002
HEAD = struct.Struct('@IIIqqqqII')  # struct bcm_msg_head
FRAME = struct.Struct('=IB3x8s')


def main() -> None:
    """Print lateness against a perfect clock."""
    print(f'{"SYNC late by p50 / p99 / max [ms]":36}' + ''.join(f'{_ms(p):>26}' for p in PERIODS))
    rows: list[tuple[str, Callable[[float], list[float]]]] = [
        ('deadlines, select() in Python', by_deadlines),
        ('BCM of the kernel, by loop-back', by_bcm),
    ]
    for title, measure in rows:
        try:
            cells = [_cell(measure(period)) for period in PERIODS]
        except OSError as error:
            print(f'{title:36}not measured: {INTERFACE}: {error.strerror or error}')
            continue
        print(f'{title:36}' + ''.join(f'{cell:>26}' for cell in cells))


def by_deadlines(period: float) -> list[float]:
    """Wait as the master does, for a socket with a time-out up to the next deadline."""
    quiet, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    late = []
    with quiet, other:
        deadline = time.monotonic()
        end = deadline + SECONDS
        while deadline < end:
            deadline += period
            while (left := deadline - time.monotonic()) > 0:
                select.select((quiet,), (), (), left)
            late.append(time.monotonic() - deadline)
    return late


def by_bcm(period: float) -> list[float]:
    """Let the kernel send, and take the times at which a raw socket sees the frames."""
    bcm = socket.socket(socket.AF_CAN, socket.SOCK_DGRAM, socket.CAN_BCM)
    raw = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    with bcm, raw:
        raw.bind((INTERFACE,))
        bcm.connect((INTERFACE,))
        frame = FRAME.pack(SYNC, 0, bytes(8))
        seconds, microseconds = divmod(round(period * 1e6), 1_000_000)
        timer = (0, 0, seconds, microseconds)  # no first interval, then this one for ever
        bcm.send(HEAD.pack(TX_SETUP, SETTIMER | STARTTIMER, 0, *timer, SYNC, 1) + frame)
        times: list[float] = []
        while len(times) < SECONDS / period:
            raw.recv(FRAME.size)
            times.append(time.monotonic())
        bcm.send(HEAD.pack(TX_DELETE, 0, 0, 0, 0, 0, 0, SYNC, 0))
    # against the perfect clock that is never ahead of it
    begin = min(moment - number * period for number, moment in enumerate(times))
    return [moment - number * period - begin for number, moment in enumerate(times)]


def _cell(late: list[float]) -> str:
    ordered = sorted(late)
    last = len(ordered) - 1
    picked = (ordered[last // 2], ordered[last * 99 // 100], ordered[last])
    return ' / '.join(f'{value * 1e3:.2f}' for value in picked)


def _ms(period: float) -> str:
    return f'every {period * 1e3:g} ms'


if __name__ == '__main__':
    main()
