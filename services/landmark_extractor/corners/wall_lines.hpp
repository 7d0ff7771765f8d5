// Upright walls: straight pieces of several rings, one above the other.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "services/landmark_extractor/parameters.hpp"
#include "services/landmark_extractor/rings/ring_runs.hpp"

namespace understory::landmark_extractor::corners {

/// Sums over points of the plan, relative to an anchor, from which a line follows.
struct LineSums {
  double count = 0.0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Matrix2d square = Eigen::Matrix2d::Zero();

  void add(const Eigen::Vector2d& point);
  LineSums& operator+=(const LineSums& other);
};

/// A straight piece of one ring.
struct LinePiece {
  Eigen::Vector2d from_m = Eigen::Vector2d::Zero();  ///< Right end as seen from the sensor.
  Eigen::Vector2d to_m = Eigen::Vector2d::Zero();
  LineSums sums;
  std::uint32_t first_part = 0;  ///< Sums of some neighbours each.
  std::uint32_t parts = 0;
  std::uint16_t ring = 0;
  double z_m = 0.0;
  double height_m = 0.0;  ///< Above ground.
  /// Last point of the cloud at either end.
  std::uint32_t first = 0;
  std::uint32_t last = 0;
  Eigen::Vector2d direction = Eigen::Vector2d::UnitX();  ///< Unit, from end to end.
  double length_m = 0.0;
};

/// A vertical plane, as far as it is seen.
struct WallLine {
  Eigen::Vector2d centroid_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d direction = Eigen::Vector2d::UnitX();  ///< Unit; to the left for the sensor.
  double from_m = 0.0;  ///< Extent along `direction`, from the centroid.
  double to_m = 0.0;
  double z_m = 0.0;             ///< Mean height of its points.
  double unevenness_m = 0.0;    ///< Of the wall beyond the noise of its points, as they show it.
  double offset_sigma_m = 0.0;  ///< Of the centroid, across.
  double direction_sigma_rad = 0.0;
  double low_z_m = 0.0;
  double high_z_m = 0.0;
  double high_height_m = 0.0;  ///< Above ground.
  int rings = 0;

  double length() const { return to_m - from_m; }
  Eigen::Vector2d normal() const { return {-direction.y(), direction.x()}; }
};

/// Keeps its memory from sweep to sweep.
class WallFinder {
 public:
  WallFinder(const SweepParameters& sweep, const CornerParameters& corner)
      : sweep_(sweep), corner_(corner) {}

  const std::vector<WallLine>& find(const rings::RingCloud& cloud,
                                    const std::vector<rings::Run>& runs);

 private:
  void split(const rings::RingCloud& cloud, const rings::Run& run, std::size_t first,
             std::size_t last);
  void add_increment(const rings::RingCloud& cloud, const rings::Run& run, std::size_t first,
                     std::size_t last);
  void join();
  bool same_wall(const LinePiece& a, const LinePiece& b) const;
  std::uint32_t root(std::uint32_t piece);
  void add_wall(const std::vector<std::uint32_t>& members);
  double unevenness(const std::vector<std::uint32_t>& members, const WallLine& wall,
                    double variance_m2) const;

  /// Some neighbours on a piece.
  struct IncrementPart {
    double count = 0.0;
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  };

  SweepParameters sweep_;
  CornerParameters corner_;
  std::vector<LinePiece> increments_;
  std::vector<IncrementPart> parts_;
  std::vector<std::size_t> ring_begins_;  ///< Among the pieces.
  std::vector<std::uint32_t> parents_;
  std::vector<std::vector<std::uint32_t>> members_;
  std::vector<WallLine> walls_;
};

}  // namespace understory::landmark_extractor::corners
