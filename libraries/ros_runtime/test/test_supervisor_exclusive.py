# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One bring-up per bus."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import os
import subprocess
import sys
import uuid

import pytest

from process_supervisor import exclusive, StartError

REMEDY = 'another bus with --can'
HOLD = """
import os, sys
from process_supervisor import exclusive, StartError
os.setuid({user})
try:
    with exclusive({bus!r}, ''):
        print('held', flush=True)
        sys.stdin.read()
except StartError as error:
    print(error, flush=True)
"""


@pytest.fixture
def bus() -> str:
    """Name a bus that no other test of this machine has."""
    return f'bus {uuid.uuid4().hex}'


@contextmanager
def another_process(bus: str, user: int) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Start a process that holds a bus; yield it and what it prints, and kill it."""
    with subprocess.Popen(
        [sys.executable, '-c', HOLD.format(bus=bus, user=user)],
        env=os.environ | {'PYTHONPATH': os.pathsep.join(sys.path)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        try:
            yield process, process.stdout.readline()
        finally:
            process.kill()


def test_long_names_differ_to_their_end(bus: str) -> None:
    """A name of a socket has room for 107 bytes; namespaces and ports may be longer."""
    long = f'{bus} {"/left" * 40}'
    with exclusive(f'{long}/a', REMEDY):
        with exclusive(f'{long}/b', REMEDY):
            pass
        with pytest.raises(StartError, match='left/a'), exclusive(f'{long}/a', REMEDY):
            pass


def test_the_second_on_a_bus_is_refused_with_the_first_ones_process(bus: str) -> None:
    """With the remedy; another bus is free; after the first has left, so is this one."""
    with exclusive(bus, REMEDY):
        for _ in range(3):  # being refused must not spoil what the next one reads
            words = rf'process {os.getpid()} of user {os.getuid()}.*{bus}.*--can'
            with pytest.raises(StartError, match=words), exclusive(bus, REMEDY):
                pass
        with exclusive(f'{bus}:5000', REMEDY):
            pass
    with exclusive(bus, REMEDY):
        pass


@pytest.mark.skipif(os.geteuid() != 0, reason='becomes another user')
def test_another_user_is_refused_too(bus: str) -> None:
    """Bus and domain are those of the host, for all users."""
    nobody = 65534
    with exclusive(bus, REMEDY), another_process(bus, nobody) as (_, said):
        assert f'process {os.getpid()} of user 0' in said
    with (
        another_process(bus, nobody) as (process, _),
        pytest.raises(StartError, match=f'process {process.pid} of user {nobody}'),
        exclusive(bus, REMEDY),
    ):
        pass


def test_a_killed_one_leaves_nothing(bus: str) -> None:
    """The kernel gives it back."""
    with another_process(bus, os.getuid()) as (_, said):
        assert said == 'held\n'
        with pytest.raises(StartError), exclusive(bus, REMEDY):
            pass
    with exclusive(bus, REMEDY):
        pass
