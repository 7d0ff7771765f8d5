// Why a datagram of the bus was refused, and how often each of these came.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace understory::bus {

/// What is wrong with a datagram, or with the message that it was a part of.
enum class DatagramFault : std::uint8_t {
  kTooShort,       ///< Ends before its header does.
  kBadMagic,       ///< Neither a message nor a fragment of LCM's.
  kNoTerminator,   ///< The channel's NUL is not in the datagram.
  kBadChannel,     ///< Empty, longer than 63 bytes, or not printable ASCII without spaces.
  kTooLarge,       ///< States a message of more than 2^28 bytes.
  kBadCount,       ///< No fragments, more fragments than bytes, or a number beyond the last.
  kOutOfBounds,    ///< Offset and size reach beyond the stated size, or wrap.
  kContradictory,  ///< States another size, number of fragments or content than the ones before.
  kRepeated,       ///< A fragment that was there already: harmless, two routes to one group.
  kOverlapping,    ///< Bytes that another fragment has brought.
  kNoRoom,         ///< Reassembly is full: dropped by the rules of UdpmReassembler.
  kIncomplete,     ///< Fragments of a message that did not come in time; counted once a message.
  kFromOutside,    ///< From another computer, on a bus of TTL 0.
};
inline constexpr std::size_t kDatagramFaults = 13;

/// Name of the fault as HEALTH shows it, lower_snake with `datagram_` in front.
std::string_view to_string(DatagramFault fault);

/// False for what costs nothing and is only counted: a repetition, and what others say.
constexpr bool is_harmful(DatagramFault fault) {
  return fault != DatagramFault::kRepeated && fault != DatagramFault::kFromOutside;
}

/// Counts by fault; a plain value.
class DatagramFaults {
 public:
  /// Counts one.
  void add(DatagramFault fault) { ++counts_[static_cast<std::size_t>(fault)]; }
  /// Sets one count.
  void set(DatagramFault fault, std::uint64_t count) {
    counts_[static_cast<std::size_t>(fault)] = count;
  }
  /// Adds all of another's.
  void add(const DatagramFaults& others);
  /// How often this fault came.
  std::uint64_t count_of(DatagramFault fault) const {
    return counts_[static_cast<std::size_t>(fault)];
  }
  /// All faults together.
  std::uint64_t total() const;

 private:
  std::array<std::uint64_t, kDatagramFaults> counts_{};
};

}  // namespace understory::bus
