#include "common/bus/udpm_socket.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <system_error>

#include "common/bus/bus_error.hpp"
#include "common/bus/port_owner.hpp"

namespace understory::bus {
namespace {

constexpr std::size_t kBatch = 16;
/// More than the largest datagram: none is truncated.
constexpr std::size_t kDatagramBytes = 65536;

[[noreturn]] void fail_to_join(const std::string& url, const std::string& what) {
  throw BusError(url + ": " + what + ": " + std::generic_category().message(errno));
}

void set_option(int file, int level, int name, int value) {
  // A refused option is not fatal: the caller reads back the values that matter.
  ::setsockopt(file, level, name, &value, sizeof(value));
}

void bind_to_group(int file, const UdpmUrl& network, const std::string& url) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(network.address);
  address.sin_port = htons(network.port);
  if (::bind(file, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) return;

  if (errno != EADDRINUSE) fail_to_join(url, "cannot bind port " + std::to_string(network.port));
  throw BusError(url + ": port " + std::to_string(network.port) + " is taken by " +
                 owners_of_udp_port(network.address, network.port) +
                 ", which does not share it: end that program or take another port");
}

void join_group(int file, const UdpmUrl& network, const std::string& url) {
  ip_mreq group{};
  group.imr_multiaddr.s_addr = htonl(network.address);
  group.imr_interface.s_addr = htonl(INADDR_ANY);
  if (::setsockopt(file, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof(group)) != 0) {
    fail_to_join(url, "cannot join the group (is there a route? understory doctor)");
  }
}

std::int64_t arrival_time_ns(msghdr& message) {
  for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr;
       part = CMSG_NXTHDR(&message, part)) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_TIMESTAMPNS) continue;
    timespec time{};
    std::memcpy(&time, CMSG_DATA(part), sizeof(time));
    return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
  }
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

}  // namespace

std::int64_t granted_buffer(int file) {
  int granted = 0;
  socklen_t size = sizeof(granted);
  ::getsockopt(file, SOL_SOCKET, SO_RCVBUF, &granted, &size);
  return granted / 2;  // the kernel reports twice the usable size
}

/// The memory of one call of recvmmsg; unused pages are never touched.
class UdpmSocket::Batch {
 public:
  std::span<const ReceivedDatagram> receive(int file) {
    for (std::size_t i = 0; i < kBatch; ++i) prepare(i);
    const int count = ::recvmmsg(file, headers_.data(), kBatch, MSG_DONTWAIT, nullptr);
    const std::size_t taken = count > 0 ? static_cast<std::size_t>(count) : 0;
    for (std::size_t i = 0; i < taken; ++i) {
      datagrams_[i].bytes = {bytes_.get() + i * kDatagramBytes, headers_[i].msg_len};
      datagrams_[i].sender = {ntohl(senders_[i].sin_addr.s_addr), ntohs(senders_[i].sin_port)};
      datagrams_[i].received_ns = arrival_time_ns(headers_[i].msg_hdr);
    }
    return {datagrams_.data(), taken};
  }

 private:
  struct alignas(cmsghdr) Control {
    std::array<char, 64> bytes{};
  };

  void prepare(std::size_t i) {
    places_[i] = {bytes_.get() + i * kDatagramBytes, kDatagramBytes};
    msghdr& header = headers_[i].msg_hdr;
    header = {};
    header.msg_name = &senders_[i];
    header.msg_namelen = sizeof(sockaddr_in);
    header.msg_iov = &places_[i];
    header.msg_iovlen = 1;
    header.msg_control = controls_[i].bytes.data();
    header.msg_controllen = controls_[i].bytes.size();
  }

  std::unique_ptr<std::uint8_t[]> bytes_ =
      std::make_unique_for_overwrite<std::uint8_t[]>(kBatch * kDatagramBytes);
  std::array<mmsghdr, kBatch> headers_{};
  std::array<iovec, kBatch> places_{};
  std::array<sockaddr_in, kBatch> senders_{};
  std::array<Control, kBatch> controls_{};
  std::array<ReceivedDatagram, kBatch> datagrams_{};
};

UdpmSocket::UdpmSocket(const UdpmUrl& network, const std::string& url)
    : file_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)), batch_(std::make_unique<Batch>()) {
  if (file_ < 0) fail_to_join(url, "no socket");
  try {
    set_option(file_, SOL_SOCKET, SO_REUSEADDR, 1);
    set_option(file_, SOL_SOCKET, SO_TIMESTAMPNS, 1);
    set_option(file_, IPPROTO_IP, IP_MULTICAST_ALL, 0);
    if (network.receive_buffer_bytes > 0) {
      set_option(file_, SOL_SOCKET, SO_RCVBUF, static_cast<int>(network.receive_buffer_bytes));
    }
    bind_to_group(file_, network, url);
    join_group(file_, network, url);
    granted_bytes_ = granted_buffer(file_);
  } catch (...) {
    ::close(file_);
    throw;
  }
}

UdpmSocket::~UdpmSocket() { ::close(file_); }

std::span<const ReceivedDatagram> UdpmSocket::receive() { return batch_->receive(file_); }

}  // namespace understory::bus
