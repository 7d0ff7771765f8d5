// Faults of the bus's datagrams, and their counts.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace understory::bus {

/// The fault of a datagram, or of its message.
enum class DatagramFault : std::uint8_t {
  kTooShort,       ///< Ends before its header does.
  kBadMagic,       ///< Neither a message nor a fragment of LCM's.
  kNoTerminator,   ///< The channel's NUL is not in the datagram.
  kBadChannel,     ///< Empty, longer than 63 bytes, or not printable ASCII without spaces.
  kTooLarge,       ///< States a message of more than 2^28 bytes.
  kBadCount,       ///< No fragments, more fragments than bytes, or a number beyond the last.
  kOutOfBounds,    ///< Offset and size reach beyond the stated size, or wrap.
  kContradictory,  ///< States another size, number of fragments or content than earlier fragments.
  kRepeated,       ///< The same fragment a second time: harmless (two routes to one group).
  kOverlapping,    ///< Contains bytes of an earlier fragment.
  kNoRoom,         ///< Reassembly is full: dropped by the rules of UdpmReassembler.
  kIncomplete,     ///< Fragments of the message are missing after the time limit; counted once per
                   ///< message.
  kFromOutside,    ///< From another computer, on a bus of TTL 0.
};
inline constexpr std::size_t kDatagramFaults = 13;

/// Name of the fault as HEALTH shows it, lower_snake with `datagram_` in front.
std::string_view to_string(DatagramFault fault);

/// False for faults without loss, which are only counted: repetitions, and datagrams from outside.
constexpr bool is_harmful(DatagramFault fault) {
  return fault != DatagramFault::kRepeated && fault != DatagramFault::kFromOutside;
}

/// Counts by fault.
class DatagramFaults {
 public:
  /// Counts one.
  void add(DatagramFault fault) { ++counts_[static_cast<std::size_t>(fault)]; }
  /// Sets the count of a fault.
  void set(DatagramFault fault, std::uint64_t count) {
    counts_[static_cast<std::size_t>(fault)] = count;
  }
  /// Adds the counts of another object.
  void add(const DatagramFaults& others);
  /// Number of datagrams with this fault.
  std::uint64_t count_of(DatagramFault fault) const {
    return counts_[static_cast<std::size_t>(fault)];
  }
  /// All faults together.
  std::uint64_t total() const;

 private:
  std::array<std::uint64_t, kDatagramFaults> counts_{};
};

}  // namespace understory::bus
