# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What can go wrong while setting up."""


class WorkspaceError(Exception):
    """Says what is wrong, and in `remedy`, of one or more lines, what a person can do about it."""

    def __init__(self, message: str, remedy: str) -> None:
        super().__init__(message)
        self.remedy = remedy

    def __str__(self) -> str:
        """Both texts, the remedy indented."""
        lines = self.remedy.splitlines()
        return '\n'.join([super().__str__(), *(f'  {line}' for line in lines)])


class NetworkError(WorkspaceError):
    """A download failed because there is no connection."""

    def __init__(self, what: str) -> None:
        super().__init__(
            f'No network: {what} could not be downloaded.',
            'Connect this machine to the network and run again; what is already there is kept.\n'
            'Behind a proxy, set HTTPS_PROXY first.',
        )


class StepFailedError(WorkspaceError):
    """A program that the set-up started ended with an error."""

    def __init__(self, what: str, code: int, tail: str) -> None:
        super().__init__(
            f'{what} failed (exit code {code}).',
            f'Its last lines:\n{tail}\nRun again after correcting it; finished steps are kept.',
        )
