// The receiving socket of a multicast group.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "common/bus/udpm_reassembly.hpp"
#include "common/bus/udpm_url.hpp"

namespace understory::bus {

/// The receive buffer that the kernel grants to a socket [bytes].
std::int64_t granted_buffer(int file);

/// A received datagram.
struct ReceivedDatagram {
  std::span<const std::uint8_t> bytes;
  DatagramSender sender;
  std::int64_t received_ns = 0;  ///< Wall clock of the kernel.
};

/// Bound to group and port with SO_REUSEADDR, as liblcm does, so that several processes of one
/// computer receive the group. Receives its group only, no unicast.
class UdpmSocket {
 public:
  /// Joins the group; `url` is for messages. Throws BusError: another program has the port and does
  /// not share it (the message names it), the group has no route, or no descriptor is left.
  UdpmSocket(const UdpmUrl& network, const std::string& url);
  ~UdpmSocket();
  UdpmSocket(const UdpmSocket&) = delete;
  UdpmSocket& operator=(const UdpmSocket&) = delete;

  /// Waiting datagrams, at most 16, by one system call without waiting. Valid until the next call.
  std::span<const ReceivedDatagram> receive();
  /// Readable when a datagram waits.
  int file_descriptor() const { return file_; }
  /// The receive buffer that the kernel grants [bytes].
  std::int64_t granted_bytes() const { return granted_bytes_; }

 private:
  class Batch;
  int file_ = -1;
  std::int64_t granted_bytes_ = 0;
  std::unique_ptr<Batch> batch_;
};

}  // namespace understory::bus
