// LCM's wire format written out once more, by itself: what the tests send.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

namespace understory::test {

using Datagram = std::vector<std::uint8_t>;

/// The fields of a fragment's header.
struct FragmentHeader {
  std::uint32_t sequence = 0;
  std::uint32_t message_size = 0;
  std::uint32_t offset = 0;
  std::uint16_t number = 0;
  std::uint16_t count = 1;
};

inline void put_number(Datagram& out, std::uint64_t value, int bytes) {
  for (int i = bytes - 1; i >= 0; --i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

inline void put_text(Datagram& out, const std::string& text) {
  out.insert(out.end(), text.begin(), text.end());
}

/// `channel_field`: the channel with its NUL, or whatever a test puts there.
inline Datagram short_datagram(std::uint32_t sequence, const std::string& channel_field,
                               const Datagram& payload) {
  Datagram out;
  put_number(out, 0x4c433032, 4);
  put_number(out, sequence, 4);
  put_text(out, channel_field);
  out.insert(out.end(), payload.begin(), payload.end());
  return out;
}

inline Datagram fragment_datagram(const FragmentHeader& header, const std::string& channel_field,
                                  const Datagram& payload) {
  Datagram out;
  put_number(out, 0x4c433033, 4);
  put_number(out, header.sequence, 4);
  put_number(out, header.message_size, 4);
  put_number(out, header.offset, 4);
  put_number(out, header.number, 2);
  put_number(out, header.count, 2);
  put_text(out, channel_field);
  out.insert(out.end(), payload.begin(), payload.end());
  return out;
}

/// A channel as it stands in a datagram.
inline std::string with_nul(std::string channel) {
  channel.push_back('\0');
  return channel;
}

/// All fragments of a message, as liblcm cuts them: `fragment_size` bytes each, the channel and its
/// NUL counted in the first.
inline std::vector<Datagram> fragments_of(std::uint32_t sequence, const std::string& channel,
                                          const Datagram& payload, std::size_t fragment_size) {
  const std::size_t total = channel.size() + 1 + payload.size();
  const std::size_t count = (total + fragment_size - 1) / fragment_size;
  std::vector<Datagram> datagrams;
  std::size_t offset = 0;
  for (std::size_t number = 0; number < count; ++number) {
    const std::size_t room = number == 0 ? fragment_size - channel.size() - 1 : fragment_size;
    const std::size_t size = std::min(room, payload.size() - offset);
    const FragmentHeader header{
        sequence, static_cast<std::uint32_t>(payload.size()), static_cast<std::uint32_t>(offset),
        static_cast<std::uint16_t>(number), static_cast<std::uint16_t>(count)};
    const auto begin = payload.begin() + static_cast<std::ptrdiff_t>(offset);
    datagrams.push_back(fragment_datagram(header, number == 0 ? with_nul(channel) : "",
                                          {begin, begin + static_cast<std::ptrdiff_t>(size)}));
    offset += size;
  }
  return datagrams;
}

/// The three datagrams of which each ended every process with liblcm 1.3.1 to 1.5.2 that heard it:
/// a fragment whose offset + size wraps 32 bits, a second fragment beyond the stated size, a short
/// message without the channel's NUL.
inline std::vector<Datagram> known_killers() {
  const Datagram hundred(100, 'x');
  return {fragment_datagram({7, 64, 0xFFFFFFC0U, 1, 2}, "", hundred),
          fragment_datagram({8, 64, 0, 0, 3}, with_nul("HEALTH"), Datagram(32, 'x')),
          fragment_datagram({8, 64, 60, 1, 3}, "", Datagram(1000, 'x')),
          short_datagram(9, "HEALTH", {})};
}

}  // namespace understory::test
