// Packets made up byte by byte.
#pragma once

#include <cstdint>
#include <cstring>
#include <random>
#include <vector>

namespace understory::test {

/// Bytes of a packet, at first random: what no field sets must not matter.
class ByteWriter {
 public:
  ByteWriter(std::size_t size, std::mt19937_64& random) : bytes_(size) {
    for (std::uint8_t& byte : bytes_) byte = static_cast<std::uint8_t>(random());
  }

  template <class Number>
  void put(std::size_t at, Number value) {
    std::memcpy(bytes_.data() + at, &value, sizeof(value));
  }
  /// Sets the bits of `mask` alone.
  void put_bits(std::size_t at, std::uint32_t value, std::uint32_t mask) {
    std::uint32_t word = 0;
    std::memcpy(&word, bytes_.data() + at, sizeof(word));
    put(at, (word & ~mask) | (value & mask));
  }
  std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  std::vector<std::uint8_t> bytes_;
};

}  // namespace understory::test
