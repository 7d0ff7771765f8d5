#include "services/geoslam_mapper/smoothing/closures.hpp"

#include <Eigen/LU>
#include <algorithm>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Squared Mahalanobis distance (3 degrees of freedom) that chance exceeds once in 10^6.
constexpr double kConsistent = 30.7;
/// Rounds of the graph for a large correction.
constexpr int kClosureRounds = 20;

double squared_distance(const geometry::SE2WithCovariance& a,
                        const geometry::SE2WithCovariance& b) {
  const Eigen::Vector3d off = (a.mean.inverse() * b.mean).Log();
  return off.dot((a.covariance + b.covariance).inverse() * off);
}

/// Solves until the closures fit, or nothing changes any more.
bool settles(std::span<const std::uint64_t> ids, PoseGraph& graph) {
  for (int round = 0; round < kClosureRounds; ++round) {
    if (!graph.solve().ok) return false;
    const bool fits = std::ranges::all_of(
        ids, [&](std::uint64_t id) { return graph.closure_chi2(id) <= kConsistent; });
    if (fits) return true;
  }
  return false;
}

}  // namespace

Closures::Decision Closures::take(const model::LoopClosure& closure, const ClosureEnd& from,
                                  const ClosureEnd& to, GlobalMap& map) {
  using enum model::LoopResult::Status;
  if (map.graph.has_closure(closure.id)) return {kAccepted, {}};
  if (std::ranges::find(waiting_, closure.id, &Waiting::id) != waiting_.end())
    return {kWaiting, "others must agree with it"};
  if (from.node == to.node) return {kRefused, "both ends are in one part of the path"};

  const Waiting one{closure.id, from.node, to.node,
                    compound(compound(from.node_T_end, closure.from_T_to), inverse(to.node_T_end))};
  const auto known = map.graph.relative(one.a, one.b);
  if (!known) return {kRefused, "the graph does not determine its ends"};

  std::vector<Waiting> counted{one};
  const bool is_expected = squared_distance(*known, one.a_T_b) <= kConsistent;
  if (!is_expected && closure.source != "manual") {
    counted = agreeing_with(one, map);
    if (counted.size() < kAgree) {
      if (waiting_.size() == kMostWaiting) waiting_.erase(waiting_.begin());
      waiting_.push_back(one);
      return {kWaiting, "it contradicts the graph: others must agree with it"};
    }
  }

  std::erase_if(waiting_, [&](const Waiting& other) {
    return std::ranges::find(counted, other.id, &Waiting::id) != counted.end();
  });
  if (!join(counted, map)) return {kRefused, "the rest of the graph contradicts it"};
  return {kAccepted, {}};
}

/// The closure and those that wait, each of which agrees with all others of them.
std::vector<Closures::Waiting> Closures::agreeing_with(const Waiting& one,
                                                       const GlobalMap& map) const {
  std::vector<Waiting> set{one};
  for (const Waiting& other : waiting_) {
    if (std::ranges::all_of(set, [&](const Waiting& in) { return agree(in, other, map); }))
      set.push_back(other);
  }
  return set;
}

/// Whether the way a -> b -> other b -> other a -> a closes.
bool Closures::agree(const Waiting& one, const Waiting& other, const GlobalMap& map) {
  const auto between = [&](NodeIndex from, NodeIndex to) {
    if (from == to) return std::optional(geometry::SE2WithCovariance{});
    return map.graph.relative(from, to);
  };
  const auto b_T_b = between(one.b, other.b);
  const auto a_T_a = between(one.a, other.a);
  if (!b_T_b || !a_T_a) return false;
  return squared_distance(compound(one.a_T_b, *b_T_b), compound(*a_T_a, other.a_T_b)) <=
         kConsistent;
}

bool Closures::join(std::span<const Waiting> closures, GlobalMap& map) {
  std::vector<std::uint64_t> ids;
  map.graph.checkpoint();
  for (const Waiting& one : closures) {
    map.graph.add_closure(one.id, one.a, one.b, one.a_T_b);
    ids.push_back(one.id);
  }
  if (!settles(ids, map.graph)) {
    map.graph.rollback();
    return false;
  }
  map.adopt_estimates();
  return true;
}

Closures::Decision Closures::revoke(std::uint64_t id, GlobalMap& map) {
  using enum model::LoopResult::Status;
  if (std::erase_if(waiting_, [&](const Waiting& one) { return one.id == id; }) > 0)
    return {kRevoked, {}};
  if (!map.graph.has_closure(id)) return {kRefused, "there is no such closure"};
  map.graph.checkpoint();
  map.graph.take_closure_out(id);
  for (int round = 0; round < kClosureRounds && map.graph.solve().ok; ++round) {
  }
  map.adopt_estimates();
  return {kRevoked, {}};
}

void Closures::hand_over(std::span<const Retirement> retired) {
  for (Waiting& one : waiting_) {
    for (const Retirement& retirement : retired) {
      if (one.a == retirement.node) {
        one.a = retirement.into;
        one.a_T_b = compound(retirement.into_T_node, one.a_T_b);
      } else if (one.b == retirement.node) {
        one.b = retirement.into;
        one.a_T_b = compound(one.a_T_b, inverse(retirement.into_T_node));
      }
    }
  }
}

}  // namespace understory::geoslam_mapper::smoothing
