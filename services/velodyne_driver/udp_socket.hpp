// A UDP socket that is only listened to.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "common/model/landmarks.hpp"

namespace understory::velodyne_driver {

struct Datagram {
  std::span<const std::uint8_t> bytes;  ///< Until the next receive().
  std::size_t size = 0;                 ///< As sent; larger than `bytes` where it was cut off.
  model::Utime received = 0;            ///< By the kernel, computer's clock [us since 1970].
  std::uint32_t sender = 0;             ///< IPv4, host's byte order.
};

/// "192.168.1.201", host's byte order; none where it is no IPv4 address.
std::optional<std::uint32_t> parse_ipv4(const std::string& text);
std::string ipv4_text(std::uint32_t address);

class UdpSocket {
 public:
  /// Throws std::runtime_error that names address and port. Nobody else may listen on the port:
  /// two readers would each get some of the packets.
  UdpSocket(const std::string& address, int port, int receive_buffer_bytes);
  ~UdpSocket();
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;

  /// None where nothing waits or the network fails; errors are counted.
  std::optional<Datagram> receive();

  int file_descriptor() const { return file_; }
  int port() const { return port_; }
  int receive_buffer_bytes() const { return receive_buffer_bytes_; }
  /// Datagrams that the kernel threw away since nobody took them in time.
  std::uint64_t overruns() const { return overruns_; }
  bool reports_overruns() const { return reports_overruns_; }
  std::uint64_t errors() const { return errors_; }
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
  std::array<std::uint8_t, 2048> buffer_{};
};

}  // namespace understory::velodyne_driver
