// Triangles of stems that recur in frames of one place.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/place_recognition/level_stems.hpp"

namespace understory::place_recognition {

/// Three stems, ordered by the lengths of the sides: corner 0 lies opposite the longest one, corner
/// 2 opposite the shortest.
struct StemTriangle {
  std::array<std::uint16_t, 3> corner{};  ///< Indices of stems.
  std::array<float, 3> side_m{};          ///< Longest, middle, shortest.
  bool is_left = false;                   ///< Corners 0, 1, 2 turn left.
};

/// Limits of the triangles.
struct StemTriangleParameters {
  /// Approximate number per frame: the longest side follows from it and from the number and density
  /// of stems.
  double triangles = 2500.0;
  double longest_m = 40.0;           ///< Longest side.
  double least_height_m = 0.4;       ///< Flatter triangles could be mirrored by noise.
  std::size_t most_neighbours = 40;  ///< Neighbours of one stem: limits the cost in thickets.
};

/// Triangles with sides up to a length that follows from the density of stems. Unlike with nearest
/// neighbours, whether three stems form a triangle does not depend on the detection of others:
/// triangles of common stems are in both lists. Uses the first 65,535 stems. O(n^2 + triangles).
std::vector<StemTriangle> stem_triangles(std::span<const LevelStem> stems,
                                         const StemTriangleParameters& parameters);

}  // namespace understory::place_recognition
