#include "services/lidar_driver/udp_socket.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <stdexcept>

namespace understory::lidar_driver {
namespace {

[[noreturn]] void fail(int file, const std::string& address, int port) {
  const std::string reason = std::strerror(errno);
  if (file >= 0) ::close(file);
  throw std::runtime_error(fmt::format("UDP port {} of {}: {}", port, address, reason));
}

model::Utime wall_now() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

bool switch_on(int file, int option) {
  const int on = 1;
  return ::setsockopt(file, SOL_SOCKET, option, &on, sizeof(on)) == 0;
}

}  // namespace

std::optional<std::uint32_t> parse_ipv4(const std::string& text) {
  in_addr address{};
  if (::inet_pton(AF_INET, text.c_str(), &address) != 1) return std::nullopt;
  return ntohl(address.s_addr);
}

UdpSocket::UdpSocket(const std::string& address, int port, int receive_buffer_bytes) {
  const auto host = parse_ipv4(address);
  if (!host) throw std::runtime_error(address + ": not an IPv4 address");
  file_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (file_ < 0) fail(file_, address, port);
  ::setsockopt(file_, SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes, sizeof(receive_buffer_bytes));
  switch_on(file_, SO_TIMESTAMP);
  reports_overruns_ = switch_on(file_, SO_RXQ_OVFL);
  sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_addr.s_addr = htonl(*host);
  name.sin_port = htons(static_cast<std::uint16_t>(port));
  socklen_t length = sizeof(name);
  if (::bind(file_, reinterpret_cast<const sockaddr*>(&name), length) != 0 ||
      ::getsockname(file_, reinterpret_cast<sockaddr*>(&name), &length) != 0)
    fail(file_, address, port);
  port_ = ntohs(name.sin_port);
  length = sizeof(receive_buffer_bytes_);
  ::getsockopt(file_, SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes_, &length);
}

UdpSocket::~UdpSocket() { ::close(file_); }

std::optional<Datagram> UdpSocket::receive() {
  sockaddr_in sender{};
  iovec place{buffer_.data(), buffer_.size()};
  alignas(cmsghdr) std::array<char, 256> control{};
  msghdr message{};
  message.msg_name = &sender;
  message.msg_namelen = sizeof(sender);
  message.msg_iov = &place;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t size = ::recvmsg(file_, &message, MSG_TRUNC);
  if (size < 0) {
    if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) {
      ++errors_;
      last_error_ = fmt::format("UDP port {}: {}", port_, std::strerror(errno));
    }
    return std::nullopt;
  }
  Datagram datagram;
  datagram.size = static_cast<std::size_t>(size);
  datagram.bytes =
      std::span<const std::uint8_t>(buffer_).first(std::min(datagram.size, buffer_.size()));
  datagram.sender = ntohl(sender.sin_addr.s_addr);
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != SOL_SOCKET) continue;
    if (c->cmsg_type == SCM_TIMESTAMP) {
      timeval time{};
      std::memcpy(&time, CMSG_DATA(c), sizeof(time));
      datagram.received = model::Utime{time.tv_sec} * 1'000'000 + time.tv_usec;
    } else if (c->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t count = 0;
      std::memcpy(&count, CMSG_DATA(c), sizeof(count));
      overruns_ += count - kernel_count_;  // the kernel's counter wraps
      kernel_count_ = count;
    }
  }
  if (datagram.received == 0) datagram.received = wall_now();
  return datagram;
}

}  // namespace understory::lidar_driver
