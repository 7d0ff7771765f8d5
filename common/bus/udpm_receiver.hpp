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

/// Reads the sockets of one or more groups, joins fragments of wanted channels, and delivers whole
/// messages of all groups in the order in which the kernel received them, also after a pause of the
/// process. The thread prevents loss during a long handler: Debian's default socket buffer has 208
/// KiB.
class UdpmReceiver {
 public:
  /// Called with each message, in the receiving thread; the views are valid during the call only.
  /// Must not throw.
  using Sink = std::function<void(std::string_view channel, std::span<const std::uint8_t> bytes,
                                  std::int64_t received_us)>;

  /// Starts to receive; signals go to the other threads. `wanted` is called in the receiving
  /// thread. Throws BusError.
  UdpmReceiver(UdpmReassembler::Wanted wanted, Sink sink);
  /// Waits for the thread: at most one batch of datagrams.
  ~UdpmReceiver();
  UdpmReceiver(const UdpmReceiver&) = delete;
  UdpmReceiver& operator=(const UdpmReceiver&) = delete;

  /// Joins one more group; `url` is for messages. With a TTL of 0, datagrams from other computers
  /// are refused. Returns the receive buffer that the kernel grants [bytes]. Throws BusError.
  std::int64_t join(const UdpmUrl& network, const std::string& url);
  /// Counts of refused datagrams up to the message delivered last.
  DatagramFaults faults() const;

 private:
  /// A socket, and its datagrams that are not handled yet.
  struct Group {
    std::unique_ptr<UdpmSocket> socket;
    bool is_open = false;  ///< Open to other computers.
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
  std::vector<Group> groups_;    // used by the thread alone
  UdpmReassembler reassembler_;  // used by the thread alone
  OwnAddresses own_addresses_;   // used by the thread alone
  DatagramFaults own_faults_;    // used by the thread alone; not the reassembler's faults
  mutable std::mutex mutex_;
  std::vector<Group> joined_;  // guarded by mutex_; the thread moves them to groups_
  bool ends_ = false;          // guarded by mutex_
  DatagramFaults faults_;      // guarded by mutex_
  int wake_ = -1;              // readable when a group was joined or the thread shall end
  std::thread thread_;
};

}  // namespace understory::bus
