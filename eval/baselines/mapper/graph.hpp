// GraphSLAM of the baseline (GeoSLAM §3.3, §4.5.6): one Gauss-Newton step per keyframe.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

namespace understory::eval::baselines::mapper {

/// The motion between two keyframes, as the thesis's published code states it.
struct PoseEdge {
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  /// Component-wise difference of the two estimates (x [m], y [m], theta [rad]) when the later pose
  /// was added. The published code then uses it as a relative motion: kept.
  Eigen::Vector3d difference = Eigen::Vector3d::Zero();

  /// All of it.
  bool operator==(const PoseEdge&) const = default;
};

/// One observation of a landmark.
struct LandmarkEdge {
  std::uint32_t pose = 0;                                ///< Index of the observing pose.
  std::uint32_t landmark = 0;                            ///< Index of the landmark.
  Eigen::Vector2d measured_m = Eigen::Vector2d::Zero();  ///< In the pose's frame.

  /// All of it.
  bool operator==(const LandmarkEdge&) const = default;
};

/// Poses, landmarks and constraints; all information matrices are 100 I.
struct Graph {
  std::vector<Eigen::Vector3d> poses;        ///< x [m], y [m], theta [rad]; frame `map`.
  std::vector<Eigen::Vector2d> landmarks_m;  ///< Frame `map`.
  std::vector<PoseEdge> pose_edges;
  std::vector<LandmarkEdge> landmark_edges;

  /// All of it.
  bool operator==(const Graph&) const = default;
};

/// A change of all variables, to be subtracted. Landmarks without a constraint have zero.
struct GraphStep {
  std::vector<Eigen::Vector3d> poses;  ///< x [m], y [m], theta [rad].
  std::vector<Eigen::Vector2d> landmarks_m;
};

/// One Gauss-Newton step with a prior I on pose 0; none when the normal matrix is not positive
/// definite. O(poses^3 + edges). (The published code adds the prior only beside a pose-pose edge,
/// assembles a wrong matrix once a landmark has two edges from one pose, and does not look at the
/// factorisation.)
std::optional<GraphStep> gauss_newton_step(const Graph& graph);

/// Weighted squared error of the newest pose's landmark edges from `first_edge` on, after `step`.
double newest_pose_error(const Graph& graph, const GraphStep& step, std::size_t first_edge);

/// Subtracts the step from all poses and landmarks.
void apply(const GraphStep& step, Graph& graph);

}  // namespace understory::eval::baselines::mapper
