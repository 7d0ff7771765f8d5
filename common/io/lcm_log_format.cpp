#include "common/io/lcm_log_format.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <limits>

namespace understory::io {
namespace {

std::uint64_t get(std::span<const std::uint8_t> bytes, std::size_t at, std::size_t count) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value = value << 8U | bytes[at + i];
  return value;
}

void put(std::span<std::uint8_t> bytes, std::size_t at, std::size_t count, std::uint64_t value) {
  for (std::size_t i = count; i-- > 0; value >>= 8U) {
    bytes[at + i] = static_cast<std::uint8_t>(value & 0xFFU);
  }
}

}  // namespace

std::array<std::uint8_t, kHeaderBytes> encode(const Header& header) {
  std::array<std::uint8_t, kHeaderBytes> bytes{};
  std::copy(kMagicBytes.begin(), kMagicBytes.end(), bytes.begin());
  put(bytes, 4, 8, static_cast<std::uint64_t>(header.number));
  put(bytes, 12, 8, static_cast<std::uint64_t>(header.utime));
  put(bytes, 20, 4, header.channel_bytes);
  put(bytes, 24, 4, header.data_bytes);
  return bytes;
}

Header decode_fields(std::span<const std::uint8_t, kHeaderBytes> bytes) {
  Header header;
  header.number = static_cast<std::int64_t>(get(bytes, 4, 8));
  header.utime = static_cast<std::int64_t>(get(bytes, 12, 8));
  header.channel_bytes = static_cast<std::uint32_t>(get(bytes, 20, 4));
  header.data_bytes = static_cast<std::uint32_t>(get(bytes, 24, 4));
  return header;
}

std::optional<Header> decode(std::span<const std::uint8_t, kHeaderBytes> bytes) {
  if (!std::equal(kMagicBytes.begin(), kMagicBytes.end(), bytes.begin())) return std::nullopt;
  const Header header = decode_fields(bytes);
  const bool lengths_possible =
      header.channel_bytes >= 1 && header.channel_bytes <= kMaxChannelBytes &&
      header.data_bytes <= static_cast<std::uint32_t>(std::numeric_limits<std::int32_t>::max());
  if (!lengths_possible) return std::nullopt;
  return header;
}

bool plausible_channel(std::span<const std::uint8_t> name) {
  return std::all_of(name.begin(), name.end(), [](std::uint8_t c) { return c > 0x20 && c < 0x7F; });
}

bool begins_as_log(const std::filesystem::path& file) {
  std::array<char, kMagicBytes.size()> start{};
  std::ifstream stream(file, std::ios::binary);
  stream.read(start.data(), start.size());
  return stream && std::ranges::equal(start, kMagicBytes, {},
                                      [](char c) { return static_cast<std::uint8_t>(c); });
}

}  // namespace understory::io
