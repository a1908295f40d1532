# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen-fake-slaves``: a command that simulates the devices of a bus.yml, without ROS."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import signal
import sys

from canopen_core import CanopenError

from .host import simulated_devices


def run(argv: Sequence[str] | None = None) -> int:
    """Simulate until Ctrl-C or SIGTERM; return the exit code."""
    parser = argparse.ArgumentParser(
        description='Simulate every device of a bus.yml, without ROS.', allow_abbrev=False
    )
    parser.add_argument(
        'bus_config', metavar='BUS.yml', help='bus.yml whose devices are simulated'
    )
    parser.add_argument(
        '--can', default='auto', metavar='BUS', help='can0, vcan0, udp_multicast:..., auto'
    )
    options = parser.parse_args(argv)
    ends = {signal.SIGINT, signal.SIGTERM}
    signal.pthread_sigmask(signal.SIG_BLOCK, ends)  # for all threads; they are waited for below
    try:
        with simulated_devices(options.bus_config, options.can) as runner:
            sys.stdout.write(
                f'{len(runner.host.devices)} simulated devices on {runner.bus_name}\n'
            )
            sys.stdout.flush()
            signal.sigwait(ends)
    except CanopenError as error:
        sys.stderr.write(f'canopen-fake-slaves: {error}\n')
        return 1
    return 0


def main() -> None:
    """Entry point."""
    sys.exit(run())


if __name__ == '__main__':
    main()
