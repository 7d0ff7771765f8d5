#include "common/bus/udpm_receiver.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <iterator>
#include <new>
#include <system_error>
#include <utility>

#include "common/bus/bus_error.hpp"

namespace understory::bus {
namespace {

std::int64_t steady_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

/// Threads created during its lifetime receive no signals.
class SignalsBlocked {
 public:
  SignalsBlocked() {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before_);
  }
  ~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalsBlocked(const SignalsBlocked&) = delete;
  SignalsBlocked& operator=(const SignalsBlocked&) = delete;

 private:
  sigset_t before_{};
};

}  // namespace

UdpmReceiver::UdpmReceiver(UdpmReassembler::Wanted wanted, Sink sink)
    : sink_(std::move(sink)),
      reassembler_({}, std::move(wanted)),
      wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (wake_ < 0) throw BusError("no descriptor left to receive with");
  try {
    const SignalsBlocked blocked;
    thread_ = std::thread([this] { run(); });
  } catch (const std::system_error& error) {
    ::close(wake_);
    throw BusError(std::string("no thread to receive with: ") + error.what());
  }
}

UdpmReceiver::~UdpmReceiver() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  ::eventfd_write(wake_, 1);
  thread_.join();
  ::close(wake_);
}

std::int64_t UdpmReceiver::join(const UdpmUrl& network, const std::string& url) {
  auto socket = std::make_unique<UdpmSocket>(network, url);
  const std::int64_t granted_bytes = socket->granted_bytes();
  {
    const std::lock_guard lock(mutex_);
    joined_.push_back({std::move(socket), network.ttl > 0});
  }
  ::eventfd_write(wake_, 1);
  return granted_bytes;
}

DatagramFaults UdpmReceiver::faults() const {
  const std::lock_guard lock(mutex_);
  return faults_;
}

void UdpmReceiver::run() noexcept {
  std::vector<pollfd> files = {{wake_, POLLIN, 0}};
  while (true) {
    ::poll(files.data(), files.size(), earliest() != nullptr ? 0 : -1);

    if (files.front().revents != 0) {
      const std::lock_guard lock(mutex_);
      if (ends_) return;
      take_in_joined();
      files.resize(1);
      for (const Group& group : groups_)
        files.push_back({group.socket->file_descriptor(), POLLIN, 0});
    }
    take_batch();
    note_faults();
  }
}

/// Precondition: the lock is held.
void UdpmReceiver::take_in_joined() {
  eventfd_t count = 0;
  ::eventfd_read(wake_, &count);
  std::ranges::move(joined_, std::back_inserter(groups_));
  joined_.clear();
}

/// Reads the sockets without waiting datagrams; false = they returned none.
bool UdpmReceiver::read_sockets() {
  bool has_more = false;
  for (Group& group : groups_) {
    if (!group.waiting.empty()) continue;
    group.waiting = group.socket->receive();
    has_more = has_more || !group.waiting.empty();
  }
  return has_more;
}

/// The group with the earliest waiting datagram; null = none waits.
UdpmReceiver::Group* UdpmReceiver::earliest() {
  Group* result = nullptr;
  for (Group& group : groups_) {
    if (group.waiting.empty()) continue;
    const bool is_first = result == nullptr ||
                          group.waiting.front().received_ns < result->waiting.front().received_ns;
    if (is_first) result = &group;
  }
  return result;
}

/// Handles datagrams until one socket must be read again. An empty socket was read after all
/// waiting datagrams had arrived, so it has no earlier one.
void UdpmReceiver::take_batch() {
  while (read_sockets()) {
  }
  const std::int64_t now_us = steady_us();
  while (Group* const group = earliest()) {
    take(*group, now_us);
    group->waiting = group->waiting.subspan(1);
    if (group->waiting.empty()) return;
  }
}

/// Handles the group's first waiting datagram.
void UdpmReceiver::take(const Group& group, std::int64_t now_us) {
  const ReceivedDatagram& datagram = group.waiting.front();
  if (!group.is_open && !own_addresses_.contains(datagram.sender.address, now_us))
    return own_faults_.add(DatagramFault::kFromOutside);
  try {
    const auto taken = reassembler_.take(datagram.bytes, datagram.sender, now_us);
    if (taken.fault) note_faults();  // before later messages are delivered
    if (taken.message) {
      sink_(taken.message->channel, taken.message->bytes, datagram.received_ns / 1000);
    }
  } catch (const std::bad_alloc&) {
    own_faults_.add(DatagramFault::kNoRoom);
  }
}

void UdpmReceiver::note_faults() {
  DatagramFaults faults = reassembler_.faults();
  faults.add(own_faults_);
  const std::lock_guard lock(mutex_);
  faults_ = faults;
}

}  // namespace understory::bus
