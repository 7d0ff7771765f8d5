// The socket that hears a multicast group.
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

/// A datagram as it came.
struct ReceivedDatagram {
  std::span<const std::uint8_t> bytes;
  DatagramSender sender;
  std::int64_t received_ns = 0;  ///< Wall clock of the kernel.
};

/// Bound to group and port, shared with every process that shares it too (SO_REUSEADDR, as liblcm
/// does), so that several hear the group on one computer. Hears its group only, and no unicast.
class UdpmSocket {
 public:
  /// Joins the group; `url` is for messages. Throws BusError: the port belongs to a program that
  /// does not share it (named), the group has no route, no descriptor is left.
  UdpmSocket(const UdpmUrl& network, const std::string& url);
  ~UdpmSocket();
  UdpmSocket(const UdpmSocket&) = delete;
  UdpmSocket& operator=(const UdpmSocket&) = delete;

  /// What has come, without waiting: up to 16 datagrams by one call of the kernel. Valid until the
  /// next call.
  std::span<const ReceivedDatagram> receive();
  /// Readable when something has come.
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
