#include "common/bag/message_reader.hpp"

#include <fmt/format.h>

#include <bit>

#include "common/bag/unpack.hpp"
#include "common/io/data_error.hpp"

namespace understory::bag {
namespace {

constexpr std::size_t kCdrHeader = 4;
/// Largest message that is packed alone [bytes]; a cloud of 10 million points is smaller.
constexpr std::uint64_t kLargestMessage = 1U << 30U;

}  // namespace

MessageReader::MessageReader(std::span<const std::uint8_t> data, Encoding encoding)
    : data_(data), encoding_(encoding) {
  if (encoding == Encoding::kOther) throw io::DataError("in an encoding that is not read");
  if (encoding == Encoding::kRos1) return;

  if (is_zstd(data)) {
    unpacked_ = unpack_zstd(data, kLargestMessage);
    data_ = unpacked_;
  }
  const auto header = take(kCdrHeader);
  // CDR_BE, CDR_LE; CDR2_BE, CDR2_LE (6, 7): the same with numbers of 8 bytes aligned to 4.
  const std::uint8_t kind = header[1];
  if (header[0] != 0 || (kind != 0 && kind != 1 && kind != 6 && kind != 7))
    throw io::DataError(fmt::format("CDR of kind {:02x} {:02x} is not read", header[0], kind));
  is_swapped_ = (kind % 2 == 1) != (std::endian::native == std::endian::little);
  if (kind >= 6) largest_alignment_ = 4;
  data_ = data_.subspan(kCdrHeader);
  at_ = 0;
}

void MessageReader::align(std::size_t bytes) {
  if (encoding_ == Encoding::kRos1) return;
  const std::size_t step = std::min(bytes, largest_alignment_);
  at_ += (step - at_ % step) % step;
}

std::span<const std::uint8_t> MessageReader::take(std::size_t count) {
  if (at_ > data_.size() || count > data_.size() - at_)
    throw io::DataError(
        fmt::format("{} bytes are wanted at byte {} of {}", count, at_, data_.size()));
  const auto taken = data_.subspan(at_, count);
  at_ += count;
  return taken;
}

std::string MessageReader::text() {
  const auto from = bytes();
  std::string text(from.begin(), from.end());
  // CDR includes a terminating zero.
  if (encoding_ == Encoding::kCdr && !text.empty() && text.back() == '\0') text.pop_back();
  return text;
}

std::size_t MessageReader::count(std::size_t least_bytes) {
  const auto count = number<std::uint32_t>();
  if (std::uint64_t{count} * least_bytes > data_.size() - at_)
    throw io::DataError(
        fmt::format("{} elements are said to follow at byte {} of {}", count, at_, data_.size()));
  return count;
}

std::span<const std::uint8_t> MessageReader::bytes() { return take(count(1)); }

}  // namespace understory::bag
