# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""SDO block transfers as the client makes them (CiA 301, 7.2.4.3.8 to 7.2.4.3.17)."""

from __future__ import annotations

import struct

from canopen_core import SdoError, SdoTimeoutError
from canopen_core.standard import AbortCode, sdo

from .scheduler import Scheduler
from .sdo_channel import Match, SdoChannel

BURST = 8  # segments that are sent at once
BURST_PAUSE = 0.001  # [s] between two bursts, in which the frames of the cycle find their way
FRUITLESS_MAX = 5  # blocks of which nothing arrives before the transfer is given up


async def write_blocks(
    channel: SdoChannel, scheduler: Scheduler, data: bytes, timeout: float
) -> None:
    """Write the object of the transfer that has begun.

    Raises:
        SdoAbortError: The device refused, or answered something that makes no sense.
        SdoTimeoutError: It did not answer, and does not have the value.
        SdoError: It did not answer the end, so it may have the value.
    """
    question = struct.pack(
        '<BHBI', sdo.DOWNLOAD_INITIATE | sdo.CRC_BIT | sdo.SIZE_BIT, *channel.address, len(data)
    )
    answer = await channel.exchange(question, _addressed(channel, sdo.DOWNLOAD_INITIATED), timeout)
    with_crc, segments = bool(answer[0] & sdo.CRC_BIT), answer[4]
    position, fruitless = 0, 0
    while position < len(data):
        if not 1 <= segments <= sdo.BLOCK_SEGMENTS_MAX:
            raise channel.refuse(AbortCode.BLOCK_SIZE)
        frames = sdo.block_frames(data, position, segments)
        for number, frame in enumerate(frames[:-1], start=1):
            await channel.deliver(frame, timeout)
            if number % BURST == 0:
                await scheduler.timer(BURST_PAUSE)
        answer = await channel.exchange(frames[-1], _command(sdo.DOWNLOAD_ACKNOWLEDGED), timeout)
        taken, segments = answer[1], answer[2]
        fruitless = 0 if taken else fruitless + 1
        if taken > len(frames) or fruitless == FRUITLESS_MAX:
            raise channel.refuse(AbortCode.SEQUENCE_NUMBER)
        position += taken * sdo.SEGMENT_BYTES
    end = sdo.end_frame(sdo.DOWNLOAD_END, data, with_crc=with_crc)
    try:
        await channel.exchange(end, _command(sdo.DOWNLOAD_ENDED), timeout)
    except SdoTimeoutError as error:
        raise SdoError(f'{error} after all of it was sent; read it back') from error


async def read_blocks(channel: SdoChannel, timeout: float, size_max: int) -> bytes:
    """Read the object of the transfer that has begun.

    Each frame of the device may take the ``timeout`` in [s]; more than ``size_max`` in [byte] is
    refused.

    Raises:
        SdoAbortError: The device refused, or answered something that makes no sense.
        SdoTimeoutError: It did not answer.
    """
    question = struct.pack(
        '<BHBBB2x', sdo.UPLOAD_INITIATE | sdo.CRC_BIT, *channel.address, sdo.BLOCK_SEGMENTS_MAX, 0
    )
    answer = await channel.exchange(question, _addressed(channel, sdo.UPLOAD_INITIATED), timeout)
    with_crc = bool(answer[0] & sdo.CRC_BIT)
    announced = int.from_bytes(answer[4:], 'little') if answer[0] & sdo.SIZE_BIT else None
    limit = size_max if announced is None else min(announced, size_max)
    data, question, finished = bytearray(), _client_frame(sdo.START_UPLOAD), False
    while not finished:
        taken, finished = await _read_block(channel, question, data, timeout)
        if len(data) >= limit + sdo.SEGMENT_BYTES:
            raise channel.refuse(AbortCode.LENGTH_HIGH, f' (more than {limit} bytes)')
        question = _client_frame(sdo.ACKNOWLEDGE_UPLOAD, taken, sdo.BLOCK_SEGMENTS_MAX)
    end = await channel.exchange(question, _command(sdo.UPLOAD_END, mask=0xE3), timeout)
    unused, (crc,) = end[0] >> 2 & 0x07, struct.unpack_from('<H', end, 1)
    del data[len(data) - unused :]
    if with_crc and crc != sdo.checksum(bytes(data)):
        raise channel.refuse(AbortCode.CRC)
    if announced is not None and len(data) != announced:
        raise channel.refuse(AbortCode.LENGTH)
    await channel.deliver(_client_frame(sdo.END_UPLOAD), timeout)
    return bytes(data)


async def _read_block(
    channel: SdoChannel, question: bytes | None, data: bytearray, timeout: float
) -> tuple[int, bool]:
    """Collect one block; return how many segments came in order, and whether all is there."""
    taken = 0
    while True:
        frame = await channel.exchange(question, _segment, timeout)
        question = None
        number, last = frame[0] & ~sdo.LAST, bool(frame[0] & sdo.LAST)
        in_order = number == taken + 1
        if in_order:
            taken = number
            data += frame[1:]
        if last or number >= sdo.BLOCK_SEGMENTS_MAX:
            return taken, last and in_order


def _client_frame(subcommand: int, *content: int) -> bytes:
    return bytes((sdo.UPLOAD_INITIATE | subcommand, *content)).ljust(8, b'\0')


def _segment(data: bytes) -> bytes | None:
    return data if len(data) == 8 and data[0] & ~sdo.LAST else None


def _command(command: int, *, mask: int = 0xFF) -> Match[bytes]:
    return lambda data: data if len(data) == 8 and data[0] & mask == command else None


def _addressed(channel: SdoChannel, command: int) -> Match[bytes]:
    """Return what reads the answer to an initiation; its bits show what the server supports."""

    def match(data: bytes) -> bytes | None:
        if len(data) != 8 or data[0] & ~(sdo.CRC_BIT | sdo.SIZE_BIT) != command:
            return None
        return data if struct.unpack_from('<xHB', data) == channel.address else None

    return match
