// Reads values from the bytes of a file; each read is checked against the remaining bytes.
#pragma once

#include <concepts>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string_view>

namespace understory::bag {

/// The bytes end in the middle of a value.
class CutOff : public std::runtime_error {
 public:
  /// `at`: offset of the value.
  explicit CutOff(std::size_t at) : std::runtime_error("cut off"), at_(at) {}
  /// Offset of the value from the first byte.
  std::size_t at() const { return at_; }

 private:
  std::size_t at_;
};

/// Reads little-endian values from front to back. Throws CutOff; allocates nothing.
class ByteReader {
 public:
  /// The bytes must outlive it.
  explicit ByteReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  /// Reads an integer.
  template <std::integral T>
  T number() {
    T value{};
    const auto from = take(sizeof(T));
    std::memcpy(&value, from.data(), sizeof(T));
    return value;
  }
  /// The next `count` bytes.
  std::span<const std::uint8_t> take(std::uint64_t count) {
    if (count > left()) throw CutOff(at_);
    const auto taken = bytes_.subspan(at_, count);
    at_ += count;
    return taken;
  }
  /// Reads text after its length of 32 bits.
  std::string_view text() {
    const std::size_t begin = at_;
    const auto length = number<std::uint32_t>();
    if (length > left()) throw CutOff(begin);
    const auto taken = take(length);
    return {reinterpret_cast<const char*>(taken.data()), taken.size()};
  }

  /// Number of bytes read.
  std::size_t at() const { return at_; }
  /// Number of remaining bytes.
  std::size_t left() const { return bytes_.size() - at_; }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

}  // namespace understory::bag
