// A fix of satellite navigation, in a local plane.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "common/model/landmarks.hpp"

namespace understory::model {

/// Channel GNSS (and RAW_GNSS): a reference for evaluation, never used for mapping.
struct GnssFix {
  Utime utime = 0;
  std::uint64_t sequence = 0;
  Eigen::Vector2d east_north_m = Eigen::Vector2d::Zero();  ///< Relative to the recording's origin.
  double sigma_m = 0.0;                              ///< Standard deviation per axis; 0 = unknown.
  std::optional<Eigen::Vector2d> velocity_mps = {};  ///< East, north.
  double velocity_sigma_mps = 0.0;                   ///< Standard deviation per axis; 0 = unknown.
};

}  // namespace understory::model
