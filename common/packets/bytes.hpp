// Numbers inside of packets: all makers send them with the least byte first.
#pragma once

#include <bit>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

namespace understory::packets {

static_assert(std::endian::native == std::endian::little);

/// A number at `at`. Precondition: it lies within `bytes`.
template <class Number>
requires std::is_arithmetic_v<Number> Number number_at(std::span<const std::uint8_t> bytes,
                                                       std::size_t at) {
  Number number;
  std::memcpy(&number, bytes.data() + at, sizeof(number));
  return number;
}

}  // namespace understory::packets
