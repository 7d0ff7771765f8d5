// Packed bytes of bags: lz4 frames, zstd, bzip2.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace understory::bag {

/// Whether unpack() knows this name: "" or "none", "lz4", "zstd", "bz2".
bool is_packing_known(std::string_view packing);

/// What unpack() gives.
struct Unpacked {
  std::vector<std::uint8_t> bytes;
  std::optional<std::string> fault;  ///< Why the bytes end early; none = whole.
};

/// Unpacks until the end or the first fault. Memory grows with what really comes out and never
/// beyond `size` (what the file says that it is), which is a fault where more would come.
Unpacked unpack(std::string_view packing, std::span<const std::uint8_t> packed, std::uint64_t size);

/// The content of a zstd frame that begins these bytes, at most `most_bytes`; throws io::DataError.
std::vector<std::uint8_t> unpack_zstd(std::span<const std::uint8_t> packed,
                                      std::uint64_t most_bytes);
/// Whether the bytes begin as zstd frames do.
bool is_zstd(std::span<const std::uint8_t> bytes);

/// No chunk of a bag is larger [bytes].
constexpr std::uint64_t kLargestChunk = 2ULL << 30U;

}  // namespace understory::bag
