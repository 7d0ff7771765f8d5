// Triangles of stems that two frames of one place have in common.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/place_recognition/level_stems.hpp"

namespace understory::place_recognition {

/// Three stems in an order that follows from the lengths of the sides: corner 0 lies opposite the
/// longest one, corner 2 opposite the shortest.
struct StemTriangle {
  std::array<std::uint16_t, 3> corner{};  ///< Indices of stems.
  std::array<float, 3> side_m{};          ///< Longest, middle, shortest.
  bool is_left = false;                   ///< Corners 0, 1, 2 turn left.
};

/// Which triangles are made.
struct StemTriangleParameters {
  /// About so many are made of a frame: the longest side follows from it and from how many stems
  /// there are and how densely they stand.
  double triangles = 2500.0;
  double longest_m = 40.0;           ///< No side is longer.
  double least_height_m = 0.4;       ///< Flatter ones could be mirrored by noise.
  std::size_t most_neighbours = 40;  ///< Of one stem: bounds the work in thickets.
};

/// Triangles whose sides are no longer than a length that follows from how densely the stems stand.
/// Whether three stems form one does not depend on which others were detected, unlike among nearest
/// neighbours: what both frames detect is in both lists. Of the first 65,535 stems. O(n^2 +
/// triangles).
std::vector<StemTriangle> stem_triangles(std::span<const LevelStem> stems,
                                         const StemTriangleParameters& parameters);

}  // namespace understory::place_recognition
