#!/bin/bash
# lcm-gen of Debian 12 (liblcm-bin 1.3.1+repack1-3), bindings for Python: a message with an array of bytes that was left
# empty cannot be sent. The generated constructor gives the field the text "", and the generated encoder refuses text:
# "TypeError: string argument without an encoding". All other arrays start as an empty list and are sent. With b"" in
# the field the same message has the 20 bytes that the format asks for.
# Seen: valid type, message as constructed, error; fails where that changes.
set -euo pipefail
readonly version=1.3.1+repack1-3
folder="$(mktemp -d)"
trap 'rm -rf "$folder"' EXIT
chmod 755 "$folder"
cd "$folder"

apt-get download "liblcm-bin=$version" > /dev/null 2>&1
dpkg -x liblcm-bin_*.deb root
cat > scan_t.lcm <<'TYPE'
package probe;
struct scan_t {
  int64_t utime;
  int32_t num_bytes;
  byte payload[num_bytes];
}
TYPE
cat > ranges_t.lcm <<'TYPE'
package probe;
struct ranges_t {
  int64_t utime;
  int32_t num_ranges;
  float ranges[num_ranges];
}
TYPE
root/usr/bin/lcm-gen -p ./*.lcm

/usr/bin/python3 - <<'CODE'
import probe

assert len(probe.ranges_t().encode()) == 20, "an empty array of floats is sent"
scan = probe.scan_t()
assert scan.payload == "", repr(scan.payload)
try:
    scan.encode()
    raise SystemExit("changed: an empty array of bytes is sent")
except TypeError as error:
    assert str(error) == "string argument without an encoding", error
scan.payload = b""
assert len(scan.encode()) == 20
again = probe.scan_t.decode(scan.encode())
assert again.payload == b"", repr(again.payload)
print("as described: a new message with an empty array of bytes cannot be encoded")
CODE
