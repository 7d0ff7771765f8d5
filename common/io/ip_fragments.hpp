// Reassembles fragmented IPv4 datagrams, which are larger than one Ethernet frame.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "common/model/landmarks.hpp"

namespace understory::io {

/// One fragment, described by its IPv4 header.
struct IpFragment {
  std::uint32_t sender = 0;  ///< IPv4, host's byte order.
  std::uint32_t receiver = 0;
  std::uint16_t identification = 0;     ///< The same for all fragments of a datagram.
  std::size_t offset = 0;               ///< Offset of the payload in the datagram [bytes].
  bool is_last = false;                 ///< It is the end of the datagram.
  std::span<const std::uint8_t> bytes;  ///< Payload behind the IPv4 header.
};

/// Joins fragments (RFC 791, section 3.2) in any order. Datagrams with overlapping fragments, with
/// more than 65,535 bytes, or incomplete after two seconds are dropped and counted. Stores at most
/// 64 datagrams.
class IpReassembler {
 public:
  /// Adds a fragment; returns the payload of the datagram if it is complete. `utime`: capture time
  /// of the fragment [us].
  std::optional<std::vector<std::uint8_t>> add(const IpFragment& fragment, model::Utime utime);
  /// Datagrams that were dropped.
  std::uint64_t dropped() const { return dropped_; }
  /// Incomplete datagrams.
  std::size_t pending() const { return pending_.size(); }

 private:
  using Key = std::tuple<std::uint32_t, std::uint32_t, std::uint16_t>;
  struct Parts {
    model::Utime begun = 0;
    std::map<std::size_t, std::vector<std::uint8_t>> by_offset;
    std::optional<std::size_t> size;  ///< Size of the datagram, known after its last fragment.

    std::optional<std::vector<std::uint8_t>> joined() const;
  };
  void drop_stale(model::Utime utime);

  std::map<Key, Parts> pending_;
  std::uint64_t dropped_ = 0;
};

}  // namespace understory::io
