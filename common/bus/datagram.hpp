// One datagram of LCM's wire format over UDP, decoded and checked alone.
//
// A short message: 'LC02', sequence number (u32), channel, NUL, payload. A fragment: 'LC03',
// sequence number (u32), size of the message's payload (u32), offset of this part in it (u32),
// number of the fragment (u16), number of fragments (u16); fragment 0 then has the channel and its
// NUL; then payload. Integers are big-endian. Offsets and sizes count payload only.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <variant>

#include "common/bus/datagram_fault.hpp"

namespace understory::bus {

/// A message that fits into one datagram; views into the datagram.
struct ShortMessage {
  std::string_view channel;
  std::span<const std::uint8_t> payload;
};

/// A part of a message; views into the datagram.
struct Fragment {
  std::uint32_t sequence = 0;             ///< Number of the message, counted by its sender.
  std::uint32_t message_size = 0;         ///< Bytes of the whole payload, at most 2^28.
  std::uint32_t offset = 0;               ///< Offset of this part in it [bytes].
  std::uint16_t number = 0;               ///< Below `count`.
  std::uint16_t count = 0;                ///< Fragments of the message, at least 1.
  std::string_view channel;               ///< Channel in fragment 0; empty in all others.
  std::span<const std::uint8_t> payload;  ///< offset + size <= message_size.
};

/// Decodes a datagram, or returns its fault. Reads nothing outside the bytes; its results keep the
/// bounds stated in Fragment. No allocation.
std::variant<ShortMessage, Fragment, DatagramFault> decode_datagram(
    std::span<const std::uint8_t> bytes);

}  // namespace understory::bus
