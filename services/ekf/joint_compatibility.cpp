#include "services/ekf/joint_compatibility.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>

namespace understory::ekf {
namespace {

/// Depth-first search. The joint covariance's Cholesky factor grows and shrinks by one pairing at a
/// time.
class Search {
 public:
  Search(const FilterState& state, std::span<const Observation> observations,
         std::span<const Candidates> candidates, const CompatibilityGates& gates)
      : state_(state),
        observations_(observations),
        candidates_(candidates),
        limits_(gates.limits),
        nodes_(gates.max_nodes) {
    const auto rows = static_cast<Eigen::Index>(2 * candidates.size());
    factor_ = Eigen::MatrixXd::Zero(rows, rows);
    whitened_ = Eigen::VectorXd::Zero(rows);
  }

  CompatibleSet run() {
    const int allowed = nodes_;
    visit(0, 0.0);
    return {best_, allowed - std::max(nodes_, 0)};
  }

 private:
  void visit(std::size_t level, double distance) {
    if (level == candidates_.size()) {
      if (may_improve(chosen_.size(), distance)) {
        best_ = chosen_;
        best_distance_ = distance;
      }
      return;
    }

    // Bounds.
    if (nodes_-- <= 0) return visit(candidates_.size(), distance);
    if (!may_improve(chosen_.size() + (candidates_.size() - level), distance)) return;

    // Pairs the observation with each free landmark.
    for (const std::uint32_t landmark : candidates_[level].landmarks) {
      if (is_taken(landmark)) continue;
      if (nodes_-- <= 0) break;
      const Pairing pairing{candidates_[level].observation, landmark};
      const double more = extend(pairing);
      if (more < 0.0 || distance + more > limits_[chosen_.size() + 1]) continue;
      chosen_.push_back(pairing);
      visit(level + 1, distance + more);
      chosen_.pop_back();
    }

    // Skips this observation, if that can still be better than the best.
    if (may_improve(chosen_.size() + (candidates_.size() - level - 1), distance)) {
      visit(level + 1, distance);
    }
  }

  bool may_improve(std::size_t size, double distance) const {
    return size > best_.size() || (size == best_.size() && distance < best_distance_);
  }

  bool is_taken(std::uint32_t landmark) const {
    return std::any_of(chosen_.begin(), chosen_.end(),
                       [&](const Pairing& p) { return p.landmark == landmark; });
  }

  /// Adds two rows to the factor; returns their contribution to the squared distance, negative if
  /// the covariance is not positive definite.
  double extend(const Pairing& pairing) {
    const auto at = static_cast<Eigen::Index>(2 * chosen_.size());
    const Observation& observation = observations_[pairing.observation];
    const Eigen::Matrix2d rotation = rotation_of(state_.heading);
    for (std::size_t k = 0; k < chosen_.size(); ++k) {
      factor_.block<2, 2>(at, static_cast<Eigen::Index>(2 * k)) =
          innovation_covariance(state_, pairing.landmark, chosen_[k].landmark, observation.height_m,
                                observations_[chosen_[k].observation].height_m);
    }

    auto row = factor_.block(at, 0, 2, at);
    if (at > 0) {
      factor_.topLeftCorner(at, at)
          .triangularView<Eigen::Lower>()
          .transpose()
          .solveInPlace<Eigen::OnTheRight>(row);
    }

    const Eigen::Matrix2d own = innovation_covariance(state_, pairing.landmark, pairing.landmark,
                                                      observation.height_m, observation.height_m) +
                                rotation * observation.covariance_m2 * rotation.transpose() -
                                row * row.transpose();
    const Eigen::LLT<Eigen::Matrix2d> llt(own);
    if (llt.info() != Eigen::Success) return -1.0;
    factor_.block<2, 2>(at, at) = llt.matrixL();

    const Eigen::Vector2d error =
        innovation(state_, pairing.landmark, observation) - row * whitened_.head(at);
    whitened_.segment<2>(at) = llt.matrixL().solve(error);
    return whitened_.segment<2>(at).squaredNorm();
  }

  const FilterState& state_;
  std::span<const Observation> observations_;
  std::span<const Candidates> candidates_;
  std::span<const double> limits_;
  int nodes_;
  Eigen::MatrixXd factor_;
  Eigen::VectorXd whitened_;
  std::vector<Pairing> chosen_;
  std::vector<Pairing> best_;
  double best_distance_ = std::numeric_limits<double>::infinity();
};

}  // namespace

CompatibleSet joint_compatibility(const FilterState& state,
                                  std::span<const Observation> observations,
                                  std::span<const Candidates> candidates,
                                  const CompatibilityGates& gates) {
  if (candidates.empty()) return {};
  return Search(state, observations, candidates, gates).run();
}

}  // namespace understory::ekf
