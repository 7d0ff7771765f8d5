#include "common/bus/udpm_receiver.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
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

/// Threads that are made while this lives take no signal.
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

UdpmReceiver::UdpmReceiver(const UdpmUrl& network, const std::string& url,
                           UdpmReassembler::Wanted wanted, Sink sink)
    : socket_(network, url),
      sink_(std::move(sink)),
      reassembler_({}, std::move(wanted)),
      stop_(::eventfd(0, EFD_CLOEXEC)) {
  if (stop_ < 0) throw BusError(url + ": no descriptor left to receive with");
  try {
    const SignalsBlocked blocked;
    thread_ = std::thread([this] { run(); });
  } catch (const std::system_error& error) {
    ::close(stop_);
    throw BusError(url + ": no thread to receive with: " + error.what());
  }
}

UdpmReceiver::~UdpmReceiver() {
  ::eventfd_write(stop_, 1);
  thread_.join();
  ::close(stop_);
}

DatagramFaults UdpmReceiver::faults() const {
  const std::lock_guard lock(mutex_);
  return faults_;
}

void UdpmReceiver::run() noexcept {
  std::array<pollfd, 2> files{{{socket_.file_descriptor(), POLLIN, 0}, {stop_, POLLIN, 0}}};
  while (true) {
    ::poll(files.data(), files.size(), -1);
    if (files[1].revents != 0) return;
    take_batch();
    note_faults();
  }
}

void UdpmReceiver::take_batch() {
  const std::int64_t now_us = steady_us();
  for (const ReceivedDatagram& datagram : socket_.receive()) {
    try {
      const auto taken = reassembler_.take(datagram.bytes, datagram.sender, now_us);
      if (taken.fault) note_faults();  // before what comes behind it is handed out
      if (taken.message) sink_(taken.message->channel, taken.message->bytes, datagram.received_us);
    } catch (const std::bad_alloc&) {
      out_of_memory_.add(DatagramFault::kNoRoom);
    }
  }
}

void UdpmReceiver::note_faults() {
  DatagramFaults faults = reassembler_.faults();
  faults.add(out_of_memory_);
  const std::lock_guard lock(mutex_);
  faults_ = faults;
}

}  // namespace understory::bus
