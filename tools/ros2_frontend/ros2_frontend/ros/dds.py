# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The networks that DDS uses, as the package `dds_network` of this checkout decides.

It need not be built, as `ros2` itself need not be.
"""

from __future__ import annotations

from collections.abc import MutableMapping
from pathlib import Path
import sys

from ..cli.errors import FrontendError

sys.path.append(str(Path(__file__).resolve().parents[4] / 'libraries' / 'dds_network'))

from dds_network import is_this_host, NETWORK_VARIABLE, NetworkChoiceError, restrict_dds

__all__ = ['is_this_host', 'restrict']


def restrict(environ: MutableMapping[str, str]) -> None:
    """Keep DDS to the networks that are open.

    Args:
        environ: The environment of this process.

    Raises:
        FrontendError: `DDS_NETWORK` names what does not exist.
    """
    try:
        restrict_dds(environ)
    except NetworkChoiceError as error:
        raise FrontendError(f'{NETWORK_VARIABLE}: {error}') from None
