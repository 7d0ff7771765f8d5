#include "common/bus/datagram_fault.hpp"

#include <numeric>

namespace understory::bus {

std::string_view to_string(DatagramFault fault) {
  switch (fault) {
    case DatagramFault::kTooShort:
      return "datagram_too_short";
    case DatagramFault::kBadMagic:
      return "datagram_bad_magic";
    case DatagramFault::kNoTerminator:
      return "datagram_no_terminator";
    case DatagramFault::kBadChannel:
      return "datagram_bad_channel";
    case DatagramFault::kTooLarge:
      return "datagram_too_large";
    case DatagramFault::kBadCount:
      return "datagram_bad_count";

    case DatagramFault::kOutOfBounds:
      return "datagram_out_of_bounds";
    case DatagramFault::kContradictory:
      return "datagram_contradictory";
    case DatagramFault::kRepeated:
      return "datagram_repeated";
    case DatagramFault::kOverlapping:
      return "datagram_overlapping";
    case DatagramFault::kNoRoom:
      return "datagram_no_room";
    case DatagramFault::kIncomplete:
      return "datagram_incomplete";
    case DatagramFault::kFromOutside:
      return "datagram_from_outside";
  }

  return "datagram_unknown";
}

void DatagramFaults::add(const DatagramFaults& others) {
  for (std::size_t i = 0; i < kDatagramFaults; ++i) counts_[i] += others.counts_[i];
}

std::uint64_t DatagramFaults::total() const {
  return std::accumulate(counts_.begin(), counts_.end(), std::uint64_t{0});
}

}  // namespace understory::bus
