// Receives the messages of a multicast group in a thread of its own.
#pragma once

#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "common/bus/udpm_socket.hpp"

namespace understory::bus {

/// Reads the socket, joins fragments of wanted channels, gives away whole messages. The thread is
/// there so that a handler that takes long costs no datagram: stock Debian's socket buffer holds
/// 208 KiB.
class UdpmReceiver {
 public:
  /// Called with each message, in the receiving thread; the views are valid during the call only.
  /// Must not throw.
  using Sink = std::function<void(std::string_view channel, std::span<const std::uint8_t> bytes,
                                  std::int64_t received_us)>;

  /// Joins and begins to receive; signals stay with the other threads. `wanted` is called in the
  /// receiving thread. Throws BusError.
  UdpmReceiver(const UdpmUrl& network, const std::string& url, UdpmReassembler::Wanted wanted,
               Sink sink);
  /// Waits for the thread: at most one batch of datagrams.
  ~UdpmReceiver();
  UdpmReceiver(const UdpmReceiver&) = delete;
  UdpmReceiver& operator=(const UdpmReceiver&) = delete;

  /// What was refused so far: all that came before the message given last.
  DatagramFaults faults() const;
  /// The receive buffer that the kernel grants [bytes].
  std::int64_t granted_bytes() const { return socket_.granted_bytes(); }

 private:
  void run() noexcept;
  void take_batch();
  void note_faults();

  UdpmSocket socket_;
  Sink sink_;
  UdpmReassembler reassembler_;   // the thread's alone
  DatagramFaults out_of_memory_;  // the thread's alone
  mutable std::mutex mutex_;
  DatagramFaults faults_;  // guarded by mutex_
  int stop_ = -1;          // readable: the thread ends
  std::thread thread_;
};

}  // namespace understory::bus
