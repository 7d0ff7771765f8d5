// How much likelier one frame's stems are where another frame was taken beside it than anywhere.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/place_recognition/level_stems.hpp"

namespace understory::place_recognition {

/// Of a detector of stems. Sigmas are standard deviations of the difference of two visits.
struct StemNoise {
  double sigma_m = 0.07;  ///< Per axis.
  /// Of a few: other heights on the stem, stems that lean, double detections [m].
  double wide_sigma_m = 0.25;
  double wide_share = 0.25;  ///< How many these are.
  /// Of the stems in the range of both frames, those that the other frame has too.
  double matched_share = 0.6;
  double diameter_log_sigma = 0.16;  ///< Of the logarithm of a diameter.
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
  /// Counts a diameter [m]; 0 = not known.
  void add(double diameter_m);
  /// Of those counted; of fewer than 20, what is usual.
  DiameterSpread spread() const;

 private:
  double count_ = 0.0;
  double mean_ = 0.0;
  double squares_ = 0.0;
};

/// A query stem and the stem of the frame that it is.
struct StemPair {
  std::uint32_t query = 0;
  std::uint32_t frame = 0;
  double distance_m = 0.0;
};

/// Stems of a frame, of it alone or as its neighbours saw them as well.
struct StemView {
  std::vector<LevelStem> stems;
  std::vector<double> weight;  ///< How sure it is that there is a stem, up to 1; one for each.
  double radius_m = 1.0;       ///< Where the view ends.
};
/// The stems of a frame alone.
StemView view_of(std::vector<LevelStem> stems);

/// The stems of a frame, prepared to be compared with many poses.
class StemLikelihood {
 public:
  /// Of those stems.
  StemLikelihood(StemView frame, const StemNoise& noise, const DiameterSpread& diameters);

  /// Natural logarithm of the likelihood of the query's stems if it was taken at that pose, over
  /// that of stems that lie anywhere as densely as the frame's. Each stem is of any stem of the
  /// frame around it or of none; outside the view it says nothing.
  /// O(query stems * (log frame stems + those in a strip of some metres)).
  double log_ratio(std::span<const LevelStem> query, const geometry::SE2& frame_T_query) const;

  /// The pose of the largest likelihood around a start (expectation and maximisation). The start
  /// may be off by some decimetres at the rim.
  geometry::SE2 refined(std::span<const LevelStem> query, const geometry::SE2& start) const;

  /// Covariance of a refined pose: the inverse of the information of its pairs, whose noise is the
  /// stated one or what the pairs show, whichever is larger. Tangent order, right perturbation.
  /// Large where there are fewer than two pairs.
  Eigen::Matrix3d covariance(std::span<const LevelStem> query, const geometry::SE2& pose,
                             std::span<const StemPair> pairs) const;

  /// Nearest neighbours of each other at the pose, nearer than `gate_m`, by query stem.
  std::vector<StemPair> pairs(std::span<const LevelStem> query, const geometry::SE2& frame_T_query,
                              double gate_m) const;

 private:
  struct Kernel {
    double narrow_variance;
    double wide_variance;
  };
  struct FrameStem {
    Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
    std::uint32_t number = 0;  ///< In the view.
    double log_diameter = 0.0;
    bool has_diameter = false;
    double weight = 1.0;
    double density_per_m2 = 0.0;  ///< Of stems around it, or of all, whichever is larger.
  };
  /// What of a query's stem does not depend on where it is.
  struct QueryDiameter {
    bool is_known = false;
    double log = 0.0;
    double anywhere = 1.0;  ///< Density of the logarithm among all stems.
  };
  std::vector<QueryDiameter> diameters_of(std::span<const LevelStem> query) const;
  /// Those that are not farther than `reach_m` from a point along x.
  std::span<const FrameStem> strip(const Eigen::Vector2d& point_m, double reach_m) const;
  /// Narrow and wide part of the mixture for one pair, over the density of stems.
  Eigen::Vector2d weight(const QueryDiameter& query, const FrameStem& stem, double squared_m2,
                         const Kernel& kernel) const;
  double diameter_ratio(const QueryDiameter& query, const FrameStem& stem) const;

  StemNoise noise_;
  DiameterSpread diameters_;
  double radius_m_;
  std::vector<FrameStem> prepared_;  ///< In order of x.
  std::vector<double> x_m_;          ///< Of each.
};

}  // namespace understory::place_recognition
