// Fields of ROS messages from their bytes: ROS 1's serialisation and CDR.
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "common/bag/bag.hpp"

namespace understory::bag {

/// Reads a message field by field, in the order of its definition; every length is checked against
/// the remaining bytes. Throws io::DataError with the message and the byte where it ends.
class MessageReader {
 public:
  /// CDR begins with its own header of four bytes: plain CDR and XCDR2 of final types are read. A
  /// message packed with zstd (rosbag2's compression_mode MESSAGE) is unpacked.
  MessageReader(std::span<const std::uint8_t> data, Encoding encoding);

  /// Reads a number; CDR aligns it to its size.
  template <class T>
  requires std::integral<T> || std::floating_point<T> T number() {
    align(sizeof(T));
    const auto from = take(sizeof(T));
    std::array<std::uint8_t, sizeof(T)> bytes{};
    std::copy(from.begin(), from.end(), bytes.begin());
    if (is_swapped_) std::reverse(bytes.begin(), bytes.end());
    T value{};
    std::memcpy(&value, bytes.data(), sizeof(T));
    return value;
  }
  /// Reads numbers of an array of fixed length.
  template <class T>
  void skip(std::size_t count) {
    if (count > 0) align(sizeof(T));
    take(count * sizeof(T));
  }
  /// Reads a string.
  std::string text();
  /// Reads the length of a sequence whose elements have at least this many bytes.
  std::size_t count(std::size_t least_bytes);
  /// Reads a sequence of bytes.
  std::span<const std::uint8_t> bytes();
  /// Reads an array of bytes of fixed length.
  std::span<const std::uint8_t> take(std::size_t count);

  /// Number of remaining bytes.
  std::size_t rest() const { return data_.size() - at_; }
  /// Encoding of the message. ROS 1 has the field `seq` in its header, and stamps without sign.
  Encoding encoding() const { return encoding_; }

 private:
  void align(std::size_t bytes);

  std::vector<std::uint8_t> unpacked_;
  std::span<const std::uint8_t> data_;
  Encoding encoding_;
  std::size_t at_ = 0;
  std::size_t largest_alignment_ = 8;
  bool is_swapped_ = false;
};

}  // namespace understory::bag
