// Receives the messages of multicast groups in a thread of its own.
#pragma once

#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/bus/own_addresses.hpp"
#include "common/bus/udpm_socket.hpp"

namespace understory::bus {

/// Reads the sockets of one or more groups, joins fragments of wanted channels, gives away whole
/// messages in the order in which the kernel received them, over all groups: also after a pause of
/// the process, when each socket holds what came meanwhile. The thread is there so that a handler
/// that takes long costs no datagram: stock Debian's socket buffer holds 208 KiB.
class UdpmReceiver {
 public:
  /// Called with each message, in the receiving thread; the views are valid during the call only.
  /// Must not throw.
  using Sink = std::function<void(std::string_view channel, std::span<const std::uint8_t> bytes,
                                  std::int64_t received_us)>;

  /// Begins to receive; signals stay with the other threads. `wanted` is called in the receiving
  /// thread. Throws BusError.
  UdpmReceiver(UdpmReassembler::Wanted wanted, Sink sink);
  /// Waits for the thread: at most one batch of datagrams.
  ~UdpmReceiver();
  UdpmReceiver(const UdpmReceiver&) = delete;
  UdpmReceiver& operator=(const UdpmReceiver&) = delete;

  /// Joins one more group; `url` is for messages. Of a TTL of 0 what comes from other computers is
  /// refused. Returns the receive buffer that the kernel grants
  /// [bytes]. Throws BusError.
  std::int64_t join(const UdpmUrl& network, const std::string& url);
  /// What was refused so far: all that came before the message given last.
  DatagramFaults faults() const;

 private:
  /// A socket, and what was read from it and not handled yet.
  struct Group {
    std::unique_ptr<UdpmSocket> socket;
    bool is_open = false;  ///< To other computers.
    std::span<const ReceivedDatagram> waiting = {};
  };

  void run() noexcept;
  void take_in_joined();
  bool read_sockets();
  Group* earliest();
  void take_batch();
  void take(const Group& group, std::int64_t now_us);
  void note_faults();

  Sink sink_;
  std::vector<Group> groups_;    // the thread's alone
  UdpmReassembler reassembler_;  // the thread's alone
  OwnAddresses own_addresses_;   // the thread's alone
  DatagramFaults own_faults_;    // the thread's alone: not the reassembler's
  mutable std::mutex mutex_;
  std::vector<Group> joined_;  // guarded by mutex_: the thread takes them
  bool ends_ = false;          // guarded by mutex_
  DatagramFaults faults_;      // guarded by mutex_
  int wake_ = -1;              // readable: a group was joined, or the thread ends
  std::thread thread_;
};

}  // namespace understory::bus
