// Captured network traffic (pcap, pcapng): the UDP payloads in it. Files only; read with libpcap.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "common/model/landmarks.hpp"

namespace understory::io {

/// The payload of one UDP packet.
struct CapturedPacket {
  model::Utime utime = 0;    ///< Capture time [us since the epoch]; of a fragmented packet the time
                             ///< of the completing fragment.
  std::uint32_t sender = 0;  ///< IPv4, host's byte order.
  std::uint16_t source_port = 0;  ///< UDP.
  std::uint16_t port = 0;         ///< UDP, destination.
  std::vector<std::uint8_t> payload;
};

/// Counts of the packets read so far.
struct CaptureCounts {
  std::uint64_t frames = 0;
  std::uint64_t fragments = 0;   ///< Of UDP packets that are larger than a frame.
  std::uint64_t incomplete = 0;  ///< UDP packets of which fragments are missing: left out.
};

/// Ethernet (with VLAN tags), Linux "cooked" (SLL, SLL2: `tcpdump -i any`), loopback or raw IPv4 as
/// link layer; IPv4, with joined fragments; UDP. Times in microseconds or nanoseconds.
class PacketCapture {
 public:
  /// Throws DataError.
  explicit PacketCapture(const std::filesystem::path& path);
  ~PacketCapture();
  /// The moved-from object permits assignment and destruction only.
  PacketCapture(PacketCapture&&) noexcept;
  PacketCapture& operator=(PacketCapture&&) noexcept;

  /// The next UDP payload; none at the end. A file cut within a frame ends there.
  std::optional<CapturedPacket> next();
  /// Counts so far.
  const CaptureCounts& counts() const;
  /// Whether the file is cut within a frame; known after next() returned none.
  bool is_cut_off() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace understory::io
