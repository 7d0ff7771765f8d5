// Values plotted by the page.
#pragma once

#include <cstdint>
#include <optional>

namespace understory::viewer {

/// 97.5 % of chi^2 with the 3 degrees of freedom of a pose: upper line of the plot of NEES.
inline constexpr double kNeesBound = 9.35;

/// Plotted values; none = unknown.
struct SceneNumbers {
  std::optional<double> error_m;    ///< Relative to ground truth.
  std::optional<double> error_rad;  ///< Likewise.
  std::optional<double> nees;       ///< Over 3 degrees of freedom.
  /// NEES has shown too small a covariance, and has not returned to its bounds since.
  bool is_too_sure = false;
  std::optional<double> nis;
  std::uint32_t nis_dof = 0;
  std::optional<double> rate_hz;        ///< Of poses.
  std::optional<double> latency_ms;     ///< From the stamp to the arrival of the pose.
  std::optional<double> missing_share;  ///< Of the map, over the last metres; see model::Existence.
  std::optional<double> new_share;      ///< Likewise.
  bool is_mapping_needed = false;
};

}  // namespace understory::viewer
