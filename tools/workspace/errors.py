# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What can go wrong while setting up.

WorkspaceError
├── UnsupportedSystemError   no ROS for this machine or Python
├── MissingPackagesError     system packages have to be installed first
├── NetworkError             a download failed for want of a connection
├── StepFailedError          a program that we started failed
├── ForeignFolderError       a folder that we would replace was made by another program
└── UnknownPackageError      the workspace does not have the package
"""


class WorkspaceError(Exception):
    """Base of all: the message has what is wrong, `remedy` what to do about it.

    Attributes:
        remedy: What a person can do, in one or more lines.
    """

    def __init__(self, message: str, remedy: str) -> None:
        super().__init__(message)
        self.remedy = remedy

    def __str__(self) -> str:
        """Both texts, the remedy indented."""
        lines = self.remedy.splitlines()
        return '\n'.join([super().__str__(), *(f'  {line}' for line in lines)])


class UnsupportedSystemError(WorkspaceError):
    """There is no ROS for this machine, or none for this Python."""


class MissingPackagesError(WorkspaceError):
    """System packages are missing.

    Attributes:
        packages: Their names for apt-get.
    """

    def __init__(self, packages: tuple[str, ...]) -> None:
        """Name all of them at once."""
        super().__init__(
            f'{len(packages)} system package{"s are" if len(packages) > 1 else " is"} missing.',
            f'Install with:\n  sudo apt-get install {" ".join(packages)}\nand run again.',
        )
        self.packages = packages


class NetworkError(WorkspaceError):
    """A download failed because there is no connection."""

    def __init__(self, what: str) -> None:
        """Name what was to be downloaded."""
        super().__init__(
            f'No network: {what} could not be downloaded.',
            'Connect this machine to the network and run again; what is already there is kept.\n'
            'Behind a proxy, set HTTPS_PROXY first.',
        )


class StepFailedError(WorkspaceError):
    """A program that the set-up started ended with an error."""

    def __init__(self, what: str, code: int, tail: str) -> None:
        """Show the last lines that the program printed."""
        super().__init__(
            f'{what} failed (exit code {code}).',
            f'Its last lines:\n{tail}\nRun again after correcting it; finished steps are kept.',
        )


class ForeignFolderError(WorkspaceError):
    """A folder is in the way that this set-up did not make."""


class UnknownPackageError(WorkspaceError):
    """The workspace has no package of that name."""
