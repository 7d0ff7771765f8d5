// The ground of a simulated world: a height field.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <random>
#include <vector>

namespace understory::sim {

/// Shape and cover of the ground.
struct GroundParameters {
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< Rise per metre along x and y.
  double relief_m = 0.0;     ///< Standard deviation of hills with wavelengths of 25-130 m.
  double roughness_m = 0.0;  ///< Standard deviation of bumps with wavelengths of 2.5-8 m.
  double cover_m = 0.0;      ///< Mean height at which grass or leaves stop a ray.
};

/// Intersection of a ray with the ground.
struct GroundHit {
  double range_m = 0.0;
  double cosine = 1.0;       ///< Of the angle between the ray and the ground's normal.
  double closing_m_m = 1.0;  ///< Loss of height above the ground per metre of the ray at the hit.
};

/// A plane plus waves, periodic with 256 m. Smooth: all derivatives exist.
class Ground {
 public:
  /// Level, at height 0.
  Ground();
  /// Ground with waves drawn from `random`.
  Ground(const GroundParameters& parameters, std::mt19937_64& random);

  /// Height at (x, y) [m].
  double height(const Eigen::Vector2d& at_m) const;
  /// Rise per metre along x and y.
  Eigen::Vector2d gradient(const Eigen::Vector2d& at_m) const;
  /// Unit normal, upwards.
  Eigen::Vector3d normal(const Eigen::Vector2d& at_m) const;
  /// Mean height of the cover (grass, leaves).
  double cover_m() const { return cover_m_; }

  /// Intersection of the ray (unit direction) with the ground within `max_m`. Uses a table with
  /// cells of 0.5 m, within 5 mm of `height`; a bump that the ray grazes for less than 0.25 m may
  /// be missed. At 0 if the ray starts below the ground.
  std::optional<GroundHit> cast(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction,
                                double max_m) const;

 private:
  struct Wave {
    Eigen::Vector2d wave_vector = Eigen::Vector2d::Zero();  ///< [rad/m]
    double phase_rad = 0.0;
    double amplitude_m = 0.0;
  };
  struct Block {
    float max_m = 0.0F;  ///< Highest of the table in the block.
    float slope = 0.0F;  ///< Bound of the table's gradient in the block.
  };
  explicit Ground(std::vector<Wave> waves);
  void add_waves(int count, double min_length_m, double max_length_m, double sigma_m,
                 std::mt19937_64& random);
  void fill_table();
  void fill_blocks();
  struct Track;
  struct Cell;
  const Block& block_at(double u, double v) const;
  GroundHit hit_at(const Track& track, double t, const Eigen::Vector3d& direction) const;

  Eigen::Vector2d slope_ = Eigen::Vector2d::Zero();
  double cover_m_ = 0.0;
  std::vector<Wave> waves_;
  std::vector<float> table_;  ///< Heights above the plane at the corners of cells, row by row.
  std::vector<Block> blocks_;
  double highest_m_ = 0.0;  ///< Of the table.
};

}  // namespace understory::sim
