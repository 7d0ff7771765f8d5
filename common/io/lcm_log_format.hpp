// The header of an event in an LCM log: encoding, decoding, and plausibility.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>

namespace understory::io {

constexpr std::array<std::uint8_t, 4> kMagicBytes{0xED, 0xA1, 0xDA, 0x01};
constexpr std::size_t kHeaderBytes = 28;
constexpr std::size_t kMaxChannelBytes = 63;

/// The fixed part of an event, in host byte order.
struct Header {
  std::int64_t number = 0;
  std::int64_t utime = 0;
  std::uint32_t channel_bytes = 0;
  std::uint32_t data_bytes = 0;

  /// Size of the whole event, header included.
  std::uint64_t event_bytes() const {
    return kHeaderBytes + std::uint64_t{channel_bytes} + data_bytes;
  }
};

/// The header's bytes, magic number included.
std::array<std::uint8_t, kHeaderBytes> encode(const Header& header);
/// The fields without any check.
Header decode_fields(std::span<const std::uint8_t, kHeaderBytes> bytes);
/// None when the bytes cannot start an event: wrong magic, or lengths that LCM never writes.
std::optional<Header> decode(std::span<const std::uint8_t, kHeaderBytes> bytes);
/// Whether this is a possible channel name: printable ASCII.
bool plausible_channel(std::span<const std::uint8_t> name);

/// Whether a file begins like a log; false also where it is not readable.
bool begins_as_log(const std::filesystem::path& file);

}  // namespace understory::io
