// The ground of a simulated world: a height field.
#pragma once

#include <Eigen/Core>
#include <random>
#include <vector>

namespace understory::sim {

struct GroundParameters {
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< Rise per metre along x and y.
  double relief_m = 0.0;     ///< Standard deviation of hills with wavelengths of 25-130 m.
  double roughness_m = 0.0;  ///< Standard deviation of bumps with wavelengths of 2.5-8 m.
};

/// A plane with waves on it, which repeat every 256 m. Smooth: all derivatives exist.
class Ground {
 public:
  /// Level, at height 0.
  Ground();
  Ground(const GroundParameters& parameters, std::mt19937_64& random);

  /// Height and its gradient at (x, y) [m].
  double height(const Eigen::Vector2d& at_m) const;
  Eigen::Vector2d gradient(const Eigen::Vector2d& at_m) const;
  Eigen::Vector3d normal(const Eigen::Vector2d& at_m) const;

  /// Distance along the ray (unit direction) to the ground if less than `max_m`, else `max_m`. Made
  /// from a table with cells of 0.5 m, within 5 mm of `height`; a bump that the ray grazes for less
  /// than 0.1 m may be missed. 0 where the ray starts below the ground.
  double cast(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction,
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
  void add_waves(int count, double min_length_m, double max_length_m, double sigma_m,
                 std::mt19937_64& random);
  void fill_table();
  void fill_blocks();
  double table_height(double x_m, double y_m) const;
  const Block& block_at(double x_m, double y_m) const;

  Eigen::Vector2d slope_ = Eigen::Vector2d::Zero();
  std::vector<Wave> waves_;
  std::vector<float> table_;  ///< Heights above the plane at the corners of cells, row by row.
  std::vector<Block> blocks_;
  double highest_m_ = 0.0;  ///< Of the table.
};

}  // namespace understory::sim
