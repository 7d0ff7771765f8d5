// Serialises values for MCAP.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace understory::mcap {

/// The records of the specification written here.
enum class Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

/// First and last bytes of a file ("Magic"): version 0.
inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};
/// Opcode and length in front of a record's content [bytes].
inline constexpr std::size_t kRecordHead = 9;

/// Appends values to bytes ("Serialization"): integers little-endian, text after its length.
class Encoder {
 public:
  /// Appends one byte.
  void u8(std::uint8_t value) { bytes_.push_back(static_cast<char>(value)); }
  /// Appends two bytes.
  void u16(std::uint16_t value) { integer(value, 2); }
  /// Appends four bytes.
  void u32(std::uint32_t value) { integer(value, 4); }
  /// Appends eight bytes; also for a Timestamp [ns].
  void u64(std::uint64_t value) { integer(value, 8); }
  /// Appends a String, or Bytes after a length of 32 bits.
  void text(std::string_view value) {
    u32(static_cast<std::uint32_t>(value.size()));
    raw(value);
  }
  /// Appends the bytes alone.
  void raw(std::string_view value) { bytes_.append(value); }
  /// Appends opcode and length of a record; its content of `size` bytes must follow.
  void head(Opcode opcode, std::uint64_t size) {
    u8(static_cast<std::uint8_t>(opcode));
    u64(size);
  }
  /// Appends a complete record.
  void record(Opcode opcode, std::string_view content) {
    head(opcode, content.size());
    raw(content);
  }

  /// All bytes so far.
  const std::string& bytes() const { return bytes_; }
  /// Clears the bytes, keeps the memory.
  void clear() { bytes_.clear(); }

 private:
  void integer(std::uint64_t value, unsigned bytes) {
    for (unsigned i = 0; i < bytes; ++i) {
      bytes_.push_back(static_cast<char>(static_cast<std::uint8_t>(value >> (8U * i))));
    }
  }

  std::string bytes_;
};

}  // namespace understory::mcap
