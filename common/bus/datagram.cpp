#include "common/bus/datagram.hpp"

#include <algorithm>

#include "common/bus/bus.hpp"

namespace understory::bus {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::uint32_t kShortMagic = 0x4c433032;     // LC02
constexpr std::uint32_t kFragmentMagic = 0x4c433033;  // LC03
constexpr std::size_t kShortHeaderBytes = 8;
constexpr std::size_t kFragmentHeaderBytes = 20;

std::uint16_t big_endian_16(Bytes bytes, std::size_t at) {
  return static_cast<std::uint16_t>((bytes[at] << 8U) | bytes[at + 1]);
}

std::uint32_t big_endian_32(Bytes bytes, std::size_t at) {
  return (std::uint32_t{big_endian_16(bytes, at)} << 16U) | big_endian_16(bytes, at + 2);
}

/// Printable ASCII without spaces: safe in a log and on a terminal.
bool is_plain(std::uint8_t c) { return c > 0x20 && c < 0x7F; }

/// Splits a channel with its NUL from the bytes after it.
std::variant<ShortMessage, DatagramFault> split_channel(Bytes bytes) {
  // A NUL beyond the longest name cannot make it valid: the search can stop there.
  const Bytes head = bytes.first(std::min(bytes.size(), kLongestChannelName + 1));
  const auto end = std::find(head.begin(), head.end(), std::uint8_t{0});
  if (end == head.end()) {
    return head.size() < bytes.size() ? DatagramFault::kBadChannel : DatagramFault::kNoTerminator;
  }

  const auto size = static_cast<std::size_t>(end - head.begin());
  if (size == 0 || !std::all_of(head.begin(), end, is_plain)) return DatagramFault::kBadChannel;
  return ShortMessage{{reinterpret_cast<const char*>(head.data()), size}, bytes.subspan(size + 1)};
}

std::variant<ShortMessage, Fragment, DatagramFault> decode_fragment(Bytes bytes) {
  if (bytes.size() < kFragmentHeaderBytes) return DatagramFault::kTooShort;
  Fragment fragment;
  fragment.sequence = big_endian_32(bytes, 4);
  fragment.message_size = big_endian_32(bytes, 8);
  fragment.offset = big_endian_32(bytes, 12);
  fragment.number = big_endian_16(bytes, 16);
  fragment.count = big_endian_16(bytes, 18);
  fragment.payload = bytes.subspan(kFragmentHeaderBytes);

  // Check the header. Every fragment but the first has at least one byte of payload.
  if (fragment.message_size > kLargestMessage) return DatagramFault::kTooLarge;
  if (fragment.number >= fragment.count) return DatagramFault::kBadCount;
  if (fragment.count - 1U > fragment.message_size) return DatagramFault::kBadCount;

  if (fragment.number == 0) {
    const auto first = split_channel(fragment.payload);
    if (const auto* fault = std::get_if<DatagramFault>(&first)) return *fault;
    fragment.channel = std::get<ShortMessage>(first).channel;
    fragment.payload = std::get<ShortMessage>(first).payload;
    if (fragment.offset != 0) return DatagramFault::kOutOfBounds;
  } else if (fragment.payload.empty()) {
    return DatagramFault::kTooShort;
  }

  // Written without a sum, because offset + size could wrap.
  if (fragment.offset > fragment.message_size ||
      fragment.payload.size() > fragment.message_size - fragment.offset) {
    return DatagramFault::kOutOfBounds;
  }
  return fragment;
}

}  // namespace

std::variant<ShortMessage, Fragment, DatagramFault> decode_datagram(Bytes bytes) {
  if (bytes.size() < kShortHeaderBytes) return DatagramFault::kTooShort;
  const std::uint32_t magic = big_endian_32(bytes, 0);
  if (magic == kFragmentMagic) return decode_fragment(bytes);
  if (magic != kShortMagic) return DatagramFault::kBadMagic;

  const auto message = split_channel(bytes.subspan(kShortHeaderBytes));
  if (const auto* fault = std::get_if<DatagramFault>(&message)) return *fault;
  return std::get<ShortMessage>(message);
}

}  // namespace understory::bus
