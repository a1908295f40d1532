# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Calling services of other nodes."""

from __future__ import annotations

import importlib
import time

from ..aliases import Handle, InterfaceClass, Message
from ..cli.errors import FrontendError, NoAnswerError
from .session import Session

_POLL = 0.01  # [s]
_POLL_LONGEST = 0.25  # [s]
_POLL_SHARE = 0.02  # of the time waited so far: who waits for minutes shall not burn a core
_APPEAR = 5.0  # [s]; how long a service of a node that exists may take to show up


class Client:
    """A client of one service.

    Attributes:
        name: The service's name.
    """

    def __init__(self, session: Session, service_type: InterfaceClass, name: str) -> None:
        """Look for a service.

        Args:
            session: The session whose node calls.
            service_type: The generated class of the service.
            name: Its name.
        """
        self.name = name
        self._session = session
        self._client: Handle = session.node.create_client(service_type, name)

    def is_ready(self) -> bool:
        """Whether the service is there, its endpoints matched."""
        return bool(self._client.service_is_ready())

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until the service is there.

        Args:
            timeout: Longest time [s]; None waits without limit.

        Returns:
            Whether it is.
        """
        begin = time.monotonic()
        while not self.is_ready():
            waited = time.monotonic() - begin
            if timeout is not None and waited >= timeout:
                return False
            time.sleep(min(max(_POLL, _POLL_SHARE * waited), _POLL_LONGEST))
        return True

    def call(self, request: Message, timeout: float | None = None) -> Message:
        """Call the service.

        Args:
            request: The request.
            timeout: Longest time [s] to wait for the answer; None waits without limit.

        Returns:
            The response.

        Raises:
            NoAnswerError: When none came in time.
            FrontendError: When the answer cannot be read.
        """
        future = self._client.call_async(request)
        if not self._session.spin_until(future.done, timeout):
            raise NoAnswerError(f"Service '{self.name}' did not answer within {timeout:g} s")
        if future.exception() is not None:
            raise FrontendError(f'Exception while calling service: {future.exception()!r}')
        return future.result()


def call(session: Session, type_name: str, name: str, **fields: object) -> Message:
    """Call a service that a node is known to offer.

    Args:
        session: The session whose node calls.
        type_name: The service's type, e.g. `rcl_interfaces/srv/GetParameters`.
        name: The service's name.
        fields: The fields of the request.

    Returns:
        The response.

    Raises:
        NoAnswerError: When the service did not appear or did not answer.
    """
    package, folder, base = type_name.split('/')
    service_type = getattr(importlib.import_module(f'{package}.{folder}'), base)
    client = Client(session, service_type, name)
    if not client.wait(_APPEAR):
        raise NoAnswerError(f"Wait for service timed out: '{name}' did not appear")
    return client.call(service_type.Request(**fields), _APPEAR)
