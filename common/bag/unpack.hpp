// Packed bytes of bags: lz4 frames, zstd, bzip2.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace understory::bag {

/// Whether unpack() reads this format: "" or "none", "lz4", "zstd", "bz2".
bool is_packing_known(std::string_view packing);

/// Result of unpack().
struct Unpacked {
  std::vector<std::uint8_t> bytes;
  std::optional<std::string> fault;  ///< Reason for an early end; none = complete.
};

/// Unpacks until the end or the first fault. Memory grows with the unpacked bytes, never beyond
/// `size` (the size stated in the file); more bytes than that are a fault.
Unpacked unpack(std::string_view packing, std::span<const std::uint8_t> packed, std::uint64_t size);

/// The content of a zstd frame that begins these bytes, at most `most_bytes`; throws io::DataError.
std::vector<std::uint8_t> unpack_zstd(std::span<const std::uint8_t> packed,
                                      std::uint64_t most_bytes);
/// Whether the bytes begin with a zstd frame.
bool is_zstd(std::span<const std::uint8_t> bytes);

/// Largest chunk of a bag [bytes].
constexpr std::uint64_t kLargestChunk = 2ULL << 30U;

}  // namespace understory::bag
