// Numbers inside of packets: all makers use little-endian order.
#pragma once

#include <Eigen/Core>
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

/// x, y, z in sequence.
template <class Number>
Eigen::Vector3d vector_at(std::span<const std::uint8_t> bytes, std::size_t at) {
  const auto component = [&](std::size_t axis) {
    return static_cast<double>(number_at<Number>(bytes, at + axis * sizeof(Number)));
  };
  return {component(0), component(1), component(2)};
}

}  // namespace understory::packets
