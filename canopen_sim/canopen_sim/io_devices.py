# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is behind the objects of simulated I/O modules (CiA 401) and encoders (CiA 406)."""

from __future__ import annotations

from canopen_core.standard import (
    DeviceProfile,
    DIGITAL_OUTPUTS,
    EncoderObject,
    ERROR_OBJECTS,
    integer_range,
    IO_GROUPS,
    profile_number,
)

from .objects.object_store import ObjectStore, Scalar, Variable

SIMULATED_SPEED = 0x2000  # of cia406_encoder.eds: how fast the shaft turns in [units/s]
CODE_SEQUENCE = 1  # bit 0 of 0x6000: the position falls when the shaft turns clockwise


class Application:
    """What a device does beside communicating: nothing."""

    def refresh(self, now: float) -> None:
        """Update the objects to a steady time in [s]."""

    def connection_lost(self) -> None:
        """React to the loss of the master, or to NMT stop."""


class IoModule(Application):
    """Inputs that are wired to the outputs of the same number, so that a program sees them act.

    An input that has no output keeps what a test writes into its variable.
    """

    def __init__(self, store: ObjectStore) -> None:
        groups = {group.name: group.entries(store.dictionary) for group in IO_GROUPS}
        self._outputs: list[tuple[Variable, Variable | None, Variable | None]] = []
        for kind in ('digital', 'analog'):
            inputs, outputs = groups[f'{kind}_inputs'], groups[f'{kind}_outputs']
            for number, entry in enumerate(outputs):
                output = store.find(*entry.address)
                # error mode and error value
                mode, value = (
                    store.find(index, entry.subindex) if (index, entry.subindex) in store else None
                    for index in ERROR_OBJECTS.get(entry.index, (0, 0))
                )
                self._outputs.append((output, mode, value))
                if number < len(inputs):
                    _wire(output, store.find(*inputs[number].address))

    def connection_lost(self) -> None:
        """Set the outputs to their error values, as far as the error mode says so."""
        for output, mode, value in self._outputs:
            if not (isinstance(output, Scalar) and isinstance(mode, Scalar)):
                continue
            after = value.value if isinstance(value, Scalar) else 0
            if output.entry.index == DIGITAL_OUTPUTS.indices[0]:  # a bit for each output
                mask = int(mode.value)
                output.value = (int(output.value) & ~mask) | (int(after) & mask)
            elif mode.value:
                output.value = after
            if output.listener is not None:
                output.listener(0.0)


def _wire(output: Variable, place: Variable) -> None:
    def copy(_: float) -> None:
        limits = integer_range(place.entry.data_type)
        if limits is None or not isinstance(output.value, int):
            place.value = output.value
        else:
            place.value = min(max(output.value, limits[0]), limits[1])

    output.listener = copy


class Encoder(Application):
    """An absolute encoder whose shaft turns at the speed of 0x2000."""

    def __init__(self, store: ObjectStore) -> None:
        self._position = store.integer(EncoderObject.POSITION)
        self._speed = store.integer(EncoderObject.SPEED, 1)
        self._range = store.integer(EncoderObject.TOTAL_RANGE, default=1 << 32)
        self._preset = store.integer(EncoderObject.PRESET)
        self._sequence = store.integer(EncoderObject.UNITS_PER_REVOLUTION - 1)
        self._commanded = store.integer(SIMULATED_SPEED)
        self._angle = 0.0  # [units] since the last preset
        self._time: float | None = None
        self._preset.listener = self._set_position

    def refresh(self, now: float) -> None:
        """Turn the shaft."""
        sign = -1 if self._sequence.value & CODE_SEQUENCE else 1
        speed = sign * self._commanded.value
        self._angle += speed * (0.0 if self._time is None else now - self._time)
        self._time = now
        self._speed.put(speed)
        self._position.value = int(self._angle // 1) % max(self._range.value, 1)

    def _set_position(self, now: float) -> None:
        self._angle = float(self._preset.value)
        self.refresh(now)


def make_application(store: ObjectStore) -> Application:
    """Return what the profile in 0x1000 asks for."""
    profile = profile_number(store.dictionary)
    if profile == DeviceProfile.GENERIC_IO:
        return IoModule(store)
    return Encoder(store) if profile == DeviceProfile.ENCODER else Application()
