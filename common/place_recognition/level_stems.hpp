// A frame's data for place recognition: its stems in the levelled frame of the sensor.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace understory::place_recognition {

/// A detected stem, frame `vehicle_level` of its frame.
struct LevelStem {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  double diameter_m = 0.0;  ///< 0 where unknown.
};

/// A frame's stems in 6 bytes each: positions to 5 mm within 160 m, diameters to 1 mm.
class PackedStems {
 public:
  /// Without stems.
  PackedStems() = default;
  /// Stems that are not finite or farther than 160 m (in x or in y) are left out.
  explicit PackedStems(std::span<const LevelStem> stems);

  /// The stems, rounded.
  std::vector<LevelStem> unpacked() const;
  /// Number of stems.
  std::size_t size() const { return stems_.size(); }
  /// Size of the stored data [bytes].
  std::size_t bytes() const { return stems_.size() * sizeof(Packed); }

 private:
  struct Packed {
    std::int16_t x = 0;
    std::int16_t y = 0;
    std::uint16_t diameter = 0;
  };
  std::vector<Packed> stems_;
};

/// Extent and density of the stems.
struct StemExtent {
  double radius_m = 1.0;        ///< At least nine in ten stems are nearer to the sensor.
  double density_per_m2 = 0.0;  ///< Density within the radius.
};
/// Extent of the stems; without stems a radius of 1 m.
StemExtent extent_of(std::span<const LevelStem> stems);

}  // namespace understory::place_recognition
