// A drive through a surveyed forest as the keyframer and the mapper hear it.
#pragma once

#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/odometry.hpp"
#include "common/model/view_ranges.hpp"
#include "eval/experiments/existence/forest_drive.hpp"
#include "sim/shared_errors.hpp"

namespace understory::eval::experiments::existence::census {

/// Lanes there and back over the whole plot, joined by half circles, a pose every
/// `setting.scan_every_m`; the first lane is `shift_m` from the plot's edge. Frame: the plot's.
std::vector<geometry::SE2> lanes_there_and_back(const std::vector<CensusStem>& stems,
                                                const ForestSetting& setting, double shift_m);

/// Messages of one place.
struct CensusScan {
  std::optional<model::Odometry> odometry;  ///< From the place before; none at the first one.
  model::ViewRanges view;
  model::LandmarkScan landmarks;
  std::vector<std::uint32_t> stems;  ///< Of each detection.
};

/// Errors of detected positions per axis.
struct CensusErrors {
  double independent_sigma_m = 0.03;
  double stated_sigma_m = 0.03;  ///< All of the error, the shared one as well.
  sim::SharedErrorParameters shared;
};
/// White noise of 0.03 m, or what is measured on a recorded walk.
CensusErrors census_errors(bool are_shared);

/// The same looks as ForestDrive's, in messages. Detections and odometry are noisy, and state their
/// noise as it is. Beams end at every stem that stands, also where the detector misses it.
class CensusDrive {
 public:
  /// Begins at `begin`; `looks` has just begun. Drives of one `forest_seed` share the errors by
  /// direction; those along the path are of `drive_seed`.
  CensusDrive(ForestDrive& looks, std::vector<geometry::SE2> path, model::Utime begin,
              const CensusErrors& errors, std::uint64_t forest_seed, std::uint64_t drive_seed,
              std::mt19937_64& random);

  /// The next place; none at the end.
  std::optional<CensusScan> next(double range_m);

 private:
  model::Odometry odometry_to(std::size_t index);
  model::LandmarkScan landmarks_at(const geometry::SE2& pose, std::size_t first_look,
                                   std::vector<std::uint32_t>& stems);
  model::ViewRanges view_from(const geometry::SE2& pose, double range_m) const;
  double draw() { return normal_(random_); }

  ForestDrive& looks_;
  std::vector<geometry::SE2> path_;
  model::Utime begin_;
  CensusErrors errors_;
  sim::SharedErrors shared_;
  double along_m_ = 0.0;  ///< Travelled up to the last place.
  std::mt19937_64& random_;
  std::normal_distribution<double> normal_;
  std::size_t next_ = 0;
};

}  // namespace understory::eval::experiments::existence::census
