// Random messages of any type, made from its layout.
#pragma once

#include <random>
#include <vector>

#include "common/wire/guard.hpp"

namespace understory::test {

/// Where a number that may not be NaN sits in the bytes.
struct RealPlace {
  std::size_t offset = 0;
  wire::FieldKind kind = wire::FieldKind::kDouble;
};

/// A well-formed message with random values; every array has 0..3 elements. Positions of floats and
/// doubles, of counts and string lengths, and of booleans are given where asked for.
wire::Bytes random_message(const wire::WireType& type, std::mt19937_64& random,
                           std::vector<RealPlace>* reals = nullptr,
                           std::vector<std::size_t>* lengths = nullptr,
                           std::vector<std::size_t>* booleans = nullptr);

/// Overwrites `size` bytes at `offset`, big-endian.
void put(wire::Bytes& bytes, std::size_t offset, std::uint64_t value, std::size_t size);

}  // namespace understory::test
