# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Starts the Python programs of a bring-up as forks of a process that has imported them.

Imports take half of the start-up time of a node, and most nodes share them. The server loads them
once, in parallel to the supervisor's preparations, and unmodified memory is shared. It has no
threads and no ROS context. Each program runs as ``__main__`` with its own session, output,
variables and command line, as if it were executed; the server is its parent, and reports its exit
code. Other programs than those of this Python interpreter are executed as usual.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
import contextlib
import ctypes
import gc
import importlib
import json
import os
from pathlib import Path
import select
import signal
import socket
import struct
import subprocess
import sys
from typing import Any, TYPE_CHECKING

from .nodes import ENVIRONMENT, Executable
from .spec import TRACES

if TYPE_CHECKING:
    from typing_extensions import Self

ANSWER_TIMEOUT = 20.0  # longest time in [s] for the imports; then programs are executed
_MESSAGE = 1 << 18  # greatest request in [byte]: argv and environment
_NICE = ('nice', '-n')
_BLOCKED = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
"""For the server, which goes when the supervisor does: its exit codes are wanted until then."""


class Forked:
    """A program that the server has started; behaves like ``subprocess.Popen``."""

    def __init__(self, server: ForkServer, pid: int) -> None:
        self.pid = pid
        self._server = server

    def wait(self) -> int:
        """Return the exit code of the ended program; 1 if the server was killed."""
        code = self._server.request({'pid': self.pid})
        return 1 if code is None else code


class ForkServer:
    """Client of the fork server in the supervisor: starts the server, and requests processes.

    Use it as a context manager around :func:`.supervise`.
    """

    def __init__(self, programs: Iterable[Executable]) -> None:
        """Start the server, which imports these programs; it can fork others, too."""
        self._link, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._link.settimeout(ANSWER_TIMEOUT)
        code = f'import sys; del sys.path[0]; from {__name__} import main; main()'
        with other:
            self._process = subprocess.Popen(
                [
                    sys.executable,
                    '-c',
                    code,
                    *(f'{each.package}:{each.name}' for each in programs),
                ],
                stdin=other.fileno(),
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                env={**os.environ, TRACES: '1', **ENVIRONMENT},  # Python reads some at its start
                start_new_session=True,  # no Ctrl-C of the terminal
            )

    @property
    def pid(self) -> int:
        """Process id of the server."""
        return self._process.pid

    def __enter__(self) -> Self:
        """Return itself; the server is already importing."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the server, even during imports; running programs continue."""
        self._link.close()
        self._process.kill()
        self._process.wait()

    def start(
        self, argv: Sequence[str], environment: Mapping[str, str], output: int
    ) -> Forked | None:
        """Start a program; return None if it must be executed instead."""
        niceness, program = (int(argv[2]), argv[3:]) if (*argv[:2],) == _NICE else (0, argv)
        try:
            with Path(program[0]).open('rb') as file:
                own = file.readline() == f'#!{sys.executable}\n'.encode()
        except OSError:
            own = False
        if not own:
            return None
        asked = {'argv': list(program), 'environment': dict(environment), 'niceness': niceness}
        pid = self.request(asked, output)
        return None if pid is None else Forked(self, pid)

    def request(self, message: Mapping[str, Any], *descriptors: int) -> int | None:
        """Send a request; return the answer of the server, None without one."""
        try:
            socket.send_fds(self._link, [json.dumps(message).encode()], descriptors)
            return int(self._link.recv(_MESSAGE))
        except (OSError, ValueError):  # it was killed, or is late: its answers would be mixed up
            self._link.close()
            return None


def main() -> None:
    """Import the programs of the command line, and fork them until the supervisor exits.

    A program is forked as soon as it is imported; the fork runs it in here, then returns.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, _BLOCKED)
    link = socket.socket(fileno=os.dup(sys.stdin.fileno()))
    gc.disable()
    programs = sys.argv[1:]
    while True:
        while programs and not select.select([link], [], [], 0.0)[0]:
            _load(programs.pop(0))
        data, descriptors, _, _ = socket.recv_fds(link, _MESSAGE, 1)
        if not data:
            os._exit(0)  # without the atexit functions of what was imported
        request = json.loads(data)
        if 'pid' in request:
            answer = os.waitstatus_to_exitcode(os.waitpid(request['pid'], 0)[1])
        else:
            file = request['argv'][0]
            while any(file.endswith(each.replace(':', '/')) for each in programs):
                _load(programs.pop(0))
            gc.freeze()
            answer = os.fork()
            if not answer:
                link.close()
                _become(request, *descriptors)
                _run(file)
                return
            os.close(*descriptors)
        link.send(f'{answer}'.encode())


def _load(program: str) -> None:
    from importlib.metadata import distribution

    package, _, name = program.partition(':')
    with contextlib.suppress(Exception):  # the program will report it
        (point,) = distribution(package).entry_points.select(name=name)
        importlib.import_module(point.module)


def _run(file: str) -> None:
    from runpy import run_path

    run_path(file, run_name='__main__')


def _become(request: Mapping[str, Any], output: int) -> None:
    """Set up this fork like an executed process."""
    os.setsid()
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.close(output)
    os.environ.clear()
    os.environ.update(request['environment'])
    os.nice(request['niceness'])
    sys.argv = request['argv']
    sys.path.insert(0, str(Path(sys.argv[0]).parent))
    _show([sys.executable, *sys.argv])
    gc.enable()
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _BLOCKED)


_PR_SET_NAME, _PR_SET_MM, _PR_SET_MM_MAP = 15, 35, 14  # linux/prctl.h
_MAP = struct.Struct('=12Q2I')  # struct prctl_mm_map
_FIELDS = (26, 27, 45, 46, 47, 0, 28, 48, 49, 50, 51)  # of proc(5), stat; 0 is not there
_shown: list[ctypes.Array[ctypes.c_char]] = []  # what the kernel reads for /proc/PID/cmdline


def _show(argv: Sequence[str]) -> None:
    """Show name and command line in ps, as far as the kernel allows that."""
    libc = ctypes.CDLL(None)
    libc.prctl(_PR_SET_NAME, os.fsencode(Path(argv[1]).name))
    libc.sbrk.restype = ctypes.c_void_p
    stat = ['', *Path('/proc/self/stat').read_text().rpartition(') ')[2].split()]
    values = [int(stat[field - 2]) if field else libc.sbrk(0) for field in _FIELDS]
    text = ctypes.create_string_buffer(b'\0'.join(map(os.fsencode, argv)))
    _shown.append(text)
    values[7:9] = [ctypes.addressof(text), ctypes.addressof(text) + len(text)]
    memory = ctypes.create_string_buffer(_MAP.pack(*values, 0, 0, 2**32 - 1), _MAP.size)
    libc.prctl(_PR_SET_MM, _PR_SET_MM_MAP, memory, _MAP.size, 0)
