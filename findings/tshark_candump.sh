#!/usr/bin/env bash
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# TShark 4.0.17 (Debian 12): it opens a log of candump as it is, and one option decodes CANopen in it.
# Expected: a conversion to pcap first. NMT, SDO, PDO, heartbeat and EMCY are named; without the option NMT is taken for
# network management of AUTOSAR. For Wireshark itself the same option is "Decode As".
# Seen: NMT: Start remote node [0x5]; Initiate download request; PDO1 (rx); Operational [0x5]; EMCY
set -eu
unset LD_LIBRARY_PATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
version=4.0.17-0+deb12u3
{
  missing=$(apt-get -s install --no-install-recommends "tshark=$version" |
    awk '/^Inst/ {print $2 "=" substr($3, 2)}')
  [ -z "$missing" ] || apt-get -qq download $missing 2>/dev/null
} || exit 2
for package in ./*.deb; do
  [ ! -f "$package" ] || dpkg-deb -x "$package" root
done

cat >bus.log <<'END'
(1700000000.000000) can0 000#0105
(1700000000.001000) can0 605#2B40600006000000
(1700000000.002000) can0 205#0F00
(1700000000.003000) can0 705#05
(1700000000.004000) can0 085#1081010000000000
END

read_log() {
  libraries=$(echo root/usr/lib/*-linux-gnu)
  HOME=$folder LD_LIBRARY_PATH=$libraries WIRESHARK_DATA_DIR=$folder/root/usr/share/wireshark \
    PATH=$folder/root/usr/bin:$PATH tshark -r bus.log "$@" 2>/dev/null
}

plain=$(read_log)
decoded=$(read_log -d can.subdissector,canopen)
printf 'without the option:\n%s\nwith it:\n%s\n' "$plain" "$decoded"
case $plain in *CANopen*) exit 1 ;; esac
for word in 'NMT: Start remote node \[0x5\]' 'Initiate download request' 'PDO1 (rx)' 'Operational \[0x5\]' EMCY; do
  grep -q "$word" <<<"$decoded" || exit 1
done
