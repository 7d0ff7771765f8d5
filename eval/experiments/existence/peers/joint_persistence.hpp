// Joint persistence of correlated features (after Nobre, Heckman, Norton: "Online Probabilistic
// Change Detection in Feature-Based Maps", ICRA 2018): persistence filters whose features are
// coupled.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace understory::eval::experiments::existence::peers {

/// Neighbours of each point: the `count` nearest within a distance [m].
std::vector<std::vector<std::uint32_t>> neighbours_of(const std::vector<Eigen::Vector3f>& points_m,
                                                      std::size_t count, float within_m);

/// The paper's joint posterior in mean field: a prior that favours equal states of neighbours by
/// `coupling` [log-odds each], with each feature's own posterior as its evidence. Fixed point of
///   logit b_i = logit p_i + coupling sum_j (2 b_j - 1).
std::vector<double> joint_beliefs(const std::vector<double>& own,
                                  const std::vector<std::vector<std::uint32_t>>& neighbours,
                                  double coupling);

}  // namespace understory::eval::experiments::existence::peers
