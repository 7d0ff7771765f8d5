// The rules of thesis 003 unchanged (Implementation, "A probability model for the elimination of
// inaccurate map points"): an ablation, `method = baseline`.
#pragma once

#include <Eigen/Core>
#include <array>

#include "common/existence/icosahedron.hpp"

namespace understory::existence {

/// Values that the thesis does not state.
struct BaselineParameters {
  double prior = 0.99;
  double visibility = 0.95;  ///< Visibility of each face before any look.
  double recall = 0.9;       ///< Recall of a visible point.
  double false_rate = 0.01;  ///< In the update of a face alone: "seen" is taken as "exists".
  /// Below this visibility a face reduces the distances of its vertices.
  double face_threshold = 0.1;
  double range_m = 40.0;
};

/// One map point by the thesis's rules:
///   - seen: P <- 1, face up by Bayes, the nearest vertex is extended to the distance. P = 1 is
///     absorbing: no later miss changes it, so a point seen once more is never removed;
///   - not seen: P and face down by Bayes; a face below its threshold halves its three distances
///   and
///     takes the mean of its neighbours' probabilities.
class BaselinePoint {
 public:
  explicit BaselinePoint(const BaselineParameters& parameters);

  /// `from_point_m`: sensor minus point. Throws std::invalid_argument where it is not finite or 0.
  void hit(const Eigen::Vector3f& from_point_m);
  void miss(const Eigen::Vector3f& from_point_m);
  /// Implementation 2: P <- P exp(-rate dt). `lost` = 1 - exp(-rate dt).
  void elapse(double lost) { probability_ *= 1.0 - lost; }

  double probability() const { return probability_; }
  double face_visibility(int face) const { return visible_[static_cast<std::size_t>(face)]; }
  double vertex_reach_m(int vertex) const { return reach_m_[static_cast<std::size_t>(vertex)]; }

 private:
  void draw_in(int face);

  BaselineParameters parameters_;
  double probability_;
  std::array<double, kFaces> visible_{};
  std::array<double, kVertices> reach_m_{};
};

}  // namespace understory::existence
