// A UDP socket that only receives.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/model/landmarks.hpp"

namespace understory::lidar_driver {

/// One received packet.
struct Datagram {
  std::span<const std::uint8_t> bytes;  ///< Valid until the next receive().
  std::size_t size = 0;                 ///< As sent; larger than `bytes` if it was truncated.
  model::Utime received = 0;            ///< By the kernel, computer's clock [us since 1970].
  std::uint32_t sender = 0;             ///< IPv4, host's byte order.
};

/// "192.168.1.201", host's byte order; none if it is no IPv4 address.
std::optional<std::uint32_t> parse_ipv4(const std::string& text);

/// Owns a bound, non-blocking socket. The kernel stamps the packets and counts those it drops.
class UdpSocket {
 public:
  /// Binds `address`:`port` (0 = any free one). Throws std::runtime_error with both in the message.
  /// No other process may use the port: two readers would each get some of the packets.
  UdpSocket(const std::string& address, int port, int receive_buffer_bytes);
  ~UdpSocket();
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;

  /// The next packet; none if no packet waits or the network fails; errors are counted.
  std::optional<Datagram> receive();

  int file_descriptor() const { return file_; }  ///< For poll().
  int port() const { return port_; }             ///< The bound port.
  /// Size granted by the kernel.
  int receive_buffer_bytes() const { return receive_buffer_bytes_; }
  /// Packets that the kernel dropped because they were not received in time.
  std::uint64_t overruns() const { return overruns_; }
  /// Whether this kernel counts them.
  bool reports_overruns() const { return reports_overruns_; }
  std::uint64_t errors() const { return errors_; }  ///< Failed receptions so far.
  /// Text of the latest one; empty = none yet.
  const std::string& last_error() const { return last_error_; }

 private:
  int file_ = -1;
  int port_ = 0;
  int receive_buffer_bytes_ = 0;
  bool reports_overruns_ = false;
  std::uint32_t kernel_count_ = 0;
  std::uint64_t overruns_ = 0;
  std::uint64_t errors_ = 0;
  std::string last_error_;
  /// Largest size of a UDP packet; an Ouster's have up to 33 kB.
  std::vector<std::uint8_t> buffer_ = std::vector<std::uint8_t>(65'536);
};

}  // namespace understory::lidar_driver
