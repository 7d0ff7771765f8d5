// IPv4 datagrams that came in fragments: larger than one Ethernet frame.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "common/model/landmarks.hpp"

namespace understory::io {

/// One fragment, as its IPv4 header says.
struct IpFragment {
  std::uint32_t sender = 0;  ///< IPv4, host's byte order.
  std::uint32_t receiver = 0;
  std::uint16_t identification = 0;     ///< The same for all fragments of a datagram.
  std::size_t offset = 0;               ///< Of the payload's first byte in the datagram.
  bool is_last = false;                 ///< No fragment lies behind it.
  std::span<const std::uint8_t> bytes;  ///< Payload behind the IPv4 header.
};

/// Joins fragments (RFC 791, section 3.2) in whatever order they come. Datagrams with overlapping
/// fragments, with more than 65,535 bytes, or that lack a fragment after two seconds, are dropped
/// and counted. Holds at most 64 datagrams.
class IpReassembler {
 public:
  /// The payload of the datagram that this fragment completes, if it does. `utime`: when the
  /// fragment was captured [us].
  std::optional<std::vector<std::uint8_t>> add(const IpFragment& fragment, model::Utime utime);
  /// Datagrams that were dropped.
  std::uint64_t dropped() const { return dropped_; }
  /// Datagrams of which fragments wait.
  std::size_t pending() const { return pending_.size(); }

 private:
  using Key = std::tuple<std::uint32_t, std::uint32_t, std::uint16_t>;
  struct Parts {
    model::Utime begun = 0;
    std::map<std::size_t, std::vector<std::uint8_t>> by_offset;
    std::optional<std::size_t> size;  ///< Of the datagram, once its last fragment came.

    std::optional<std::vector<std::uint8_t>> joined() const;
  };
  void drop_stale(model::Utime utime);

  std::map<Key, Parts> pending_;
  std::uint64_t dropped_ = 0;
};

}  // namespace understory::io
