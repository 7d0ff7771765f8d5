// Likelihood of a frame's stems at a pose near another frame, relative to random stems.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/place_recognition/level_stems.hpp"

namespace understory::place_recognition {

/// Noise of a detector of stems. Sigmas are standard deviations of the difference between two
/// visits.
struct StemNoise {
  double sigma_m = 0.07;  ///< Standard deviation per axis.
  /// The same for a share of the stems: other heights on the stem, leaning stems, double detections
  /// [m].
  double wide_sigma_m = 0.25;
  double wide_share = 0.25;  ///< Share of these stems.
  /// Share of common stems in the range of both frames.
  double matched_share = 0.6;
  double diameter_log_sigma = 0.16;  ///< Standard deviation of the logarithm of a diameter.
  double wide_diameter_log_sigma = 0.5;
  double wide_diameter_share = 0.15;
  bool use_diameters = true;
};

/// Logarithms of diameters in a forest: mean and standard deviation.
struct DiameterSpread {
  double mean = -1.3;
  double sigma = 0.45;
};

/// Running mean and spread of the logarithms of diameters.
class DiameterStatistics {
 public:
  /// Counts a diameter [m]; 0 = unknown.
  void add(double diameter_m);
  /// Spread of the counted ones; a default for fewer than 20.
  DiameterSpread spread() const;

 private:
  double count_ = 0.0;
  double mean_ = 0.0;
  double squares_ = 0.0;
};

/// A query stem and the same stem in the frame.
struct StemPair {
  std::uint32_t query = 0;
  std::uint32_t frame = 0;
  double distance_m = 0.0;
};

/// Stems of a frame, from it alone or also from its neighbours.
struct StemView {
  std::vector<LevelStem> stems;
  std::vector<double> weight;  ///< Confidence of each stem, up to 1.
  double radius_m = 1.0;       ///< Radius of the view.
};
/// The stems of a frame alone.
StemView view_of(std::vector<LevelStem> stems);

/// The stems of a frame, prepared to be compared with many poses.
class StemLikelihood {
 public:
  /// Prepares these stems.
  StemLikelihood(StemView frame, const StemNoise& noise, const DiameterSpread& diameters);

  /// Natural logarithm of the likelihood of the query's stems taken at that pose, relative to
  /// random stems of the frame's density. Each stem may belong to any stem of the frame around it
  /// or to none; stems outside the view are ignored. O(query stems * (log frame stems + stems in a
  /// strip of some metres)).
  double log_ratio(std::span<const LevelStem> query, const geometry::SE2& frame_T_query) const;

  /// The pose of the largest likelihood around a start (expectation and maximisation). The start
  /// may be wrong by some decimetres at the rim.
  geometry::SE2 refined(std::span<const LevelStem> query, const geometry::SE2& start) const;

  /// Covariance of a refined pose: the inverse of the information of its pairs, with the stated
  /// noise or that of the residuals, whichever is larger. Tangent order, right perturbation. Large
  /// with fewer than two pairs.
  Eigen::Matrix3d covariance(std::span<const LevelStem> query, const geometry::SE2& pose,
                             std::span<const StemPair> pairs) const;

  /// Mutual nearest neighbours at the pose within `gate_m`, by query stem.
  std::vector<StemPair> pairs(std::span<const LevelStem> query, const geometry::SE2& frame_T_query,
                              double gate_m) const;

 private:
  struct Kernel {
    double narrow_variance;
    double wide_variance;
  };
  struct FrameStem {
    Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
    std::uint32_t number = 0;  ///< Index in the view.
    double log_diameter = 0.0;
    bool has_diameter = false;
    double weight = 1.0;
    double density_per_m2 = 0.0;  ///< Density of stems around it, or of all, whichever is larger.
  };
  /// Values of a query's stem that do not depend on its position.
  struct QueryDiameter {
    bool is_known = false;
    double log = 0.0;
    double anywhere = 1.0;  ///< Density of the logarithm among all stems.
  };
  std::vector<QueryDiameter> diameters_of(std::span<const LevelStem> query) const;
  /// Stems within `reach_m` of a point along x.
  std::span<const FrameStem> strip(const Eigen::Vector2d& point_m, double reach_m) const;
  /// Narrow and wide part of the mixture for one pair, relative to the density of stems.
  Eigen::Vector2d weight(const QueryDiameter& query, const FrameStem& stem, double squared_m2,
                         const Kernel& kernel) const;
  double diameter_ratio(const QueryDiameter& query, const FrameStem& stem) const;

  StemNoise noise_;
  DiameterSpread diameters_;
  double radius_m_;
  std::vector<FrameStem> prepared_;  ///< Sorted by x.
  std::vector<double> x_m_;          ///< x of each.
};

}  // namespace understory::place_recognition
