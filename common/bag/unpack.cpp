#include "common/bag/unpack.hpp"

#include <bzlib.h>
#include <fmt/format.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <memory>

#include "common/io/data_error.hpp"

namespace understory::bag {
namespace {

constexpr std::size_t kPiece = 256 * 1024;
using Packed = std::span<const std::uint8_t>;

/// Result of one step of unpacking.
struct Step {
  std::size_t read = 0;
  std::size_t written = 0;
  bool is_end = false;  ///< A frame ended.
  const char* fault = nullptr;
};

/// Collects pieces; `step` unpacks from the remaining bytes into a piece.
template <class DoStep>
Unpacked collect(Packed packed, std::uint64_t size, DoStep step) {
  Unpacked out;
  std::vector<std::uint8_t> piece(kPiece);
  bool is_end = packed.empty();

  while (true) {
    const Step done = step(packed, std::span<std::uint8_t>(piece));
    if (done.fault != nullptr) {
      out.fault = done.fault;
      return out;
    }

    if (done.written > size - out.bytes.size()) {
      out.fault = fmt::format("more than the {} bytes that it should have", size);
      return out;
    }

    out.bytes.insert(out.bytes.end(), piece.begin(),
                     piece.begin() + static_cast<std::ptrdiff_t>(done.written));
    packed = packed.subspan(done.read);
    if (done.read > 0 || done.written > 0) is_end = done.is_end;
    if (packed.empty() && done.written < piece.size()) break;
    if (done.read == 0 && done.written == 0) break;
  }

  if (!is_end) out.fault = "packed bytes end in the middle";
  return out;
}

Unpacked from_zstd(Packed packed, std::uint64_t size) {
  const std::unique_ptr<ZSTD_DCtx, std::size_t (*)(ZSTD_DCtx*)> context(ZSTD_createDCtx(),
                                                                        ZSTD_freeDCtx);
  // Frames with a window above 128 MiB are refused by default.
  return collect(packed, size, [&](Packed from, std::span<std::uint8_t> to) {
    ZSTD_inBuffer in{from.data(), from.size(), 0};
    ZSTD_outBuffer out{to.data(), to.size(), 0};
    const std::size_t result = ZSTD_decompressStream(context.get(), &out, &in);
    Step step{in.pos, out.pos, result == 0, nullptr};
    if (ZSTD_isError(result) != 0) step.fault = ZSTD_getErrorName(result);
    return step;
  });
}

Unpacked from_lz4(Packed packed, std::uint64_t size) {
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION)) != 0) {
    return {{}, "lz4 cannot begin"};
  }
  const std::unique_ptr<LZ4F_dctx, std::size_t (*)(LZ4F_dctx*)> context(
      raw, LZ4F_freeDecompressionContext);
  return collect(packed, size, [&](Packed from, std::span<std::uint8_t> to) {
    std::size_t read = from.size();
    std::size_t written = to.size();
    const std::size_t result =
        LZ4F_decompress(context.get(), to.data(), &written, from.data(), &read, nullptr);
    Step step{read, written, result == 0, nullptr};
    if (LZ4F_isError(result) != 0) step.fault = LZ4F_getErrorName(result);
    return step;
  });
}

Unpacked from_bz2(Packed packed, std::uint64_t size) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) return {{}, "bzip2 cannot begin"};
  const std::unique_ptr<bz_stream, int (*)(bz_stream*)> end(&stream, BZ2_bzDecompressEnd);
  bool is_over = false;

  return collect(packed, size, [&](Packed from, std::span<std::uint8_t> to) {
    if (is_over) return Step{from.size(), 0, true, nullptr};
    const auto most = std::min<std::size_t>(from.size(), 1U << 30U);
    // The interface has no const; bzip2 does not write there.
    stream.next_in = const_cast<char*>(reinterpret_cast<const char*>(from.data()));  // NOLINT
    stream.avail_in = static_cast<unsigned int>(most);
    stream.next_out = reinterpret_cast<char*>(to.data());
    stream.avail_out = static_cast<unsigned int>(to.size());

    const int result = BZ2_bzDecompress(&stream);
    is_over = result == BZ_STREAM_END;
    Step step{most - stream.avail_in, to.size() - stream.avail_out, is_over, nullptr};
    if (result != BZ_OK && !is_over) step.fault = "damaged bzip2 data";
    return step;
  });
}

}  // namespace

bool is_packing_known(std::string_view packing) {
  constexpr std::array<std::string_view, 5> kKnown{"", "none", "lz4", "zstd", "bz2"};
  return std::ranges::find(kKnown, packing) != kKnown.end();
}

Unpacked unpack(std::string_view packing, Packed packed, std::uint64_t size) {
  if (size > kLargestChunk)
    return {{}, fmt::format("{} bytes, more than the {} that are read", size, kLargestChunk)};

  Unpacked out;
  if (packing == "zstd") {
    out = from_zstd(packed, size);
  } else if (packing == "lz4") {
    out = from_lz4(packed, size);
  } else if (packing == "bz2") {
    out = from_bz2(packed, size);
  } else if (is_packing_known(packing)) {
    out.bytes.assign(packed.begin(), packed.end());
  } else {
    out.fault = "packed in a way that is not known";
  }

  if (!out.fault && out.bytes.size() != size)
    out.fault = fmt::format("{} of the {} bytes that it should have", out.bytes.size(), size);
  return out;
}

bool is_zstd(Packed bytes) {
  constexpr std::array<std::uint8_t, 4> kMagic{0x28, 0xB5, 0x2F, 0xFD};
  return bytes.size() >= kMagic.size() && std::ranges::equal(bytes.first(4), kMagic);
}

std::vector<std::uint8_t> unpack_zstd(Packed packed, std::uint64_t most_bytes) {
  Unpacked out = from_zstd(packed, most_bytes);
  if (out.fault) throw io::DataError("damaged zstd data: " + *out.fault);
  return std::move(out.bytes);
}

}  // namespace understory::bag
