#include "services/geoslam_mapper/smoothing/closures.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Squared Mahalanobis distance (3 degrees of freedom) that chance exceeds once in 10^6.
constexpr double kConsistent = 30.7;
/// Largest ratio by which closures may show the graph's variances to be understated when they are
/// compared: the short paths between closures are not trusted more than the long one.
constexpr double kMostMisstated = 100.0;
/// Two closures can support each other only if the graph ties them to within this standard
/// deviation [m]: with a looser tie any two agree.
constexpr double kMostSpread_m = 2.0;
/// Iterations of the graph for a large correction.
constexpr int kClosureRounds = 20;

double squared_distance(const geometry::SE2WithCovariance& a,
                        const geometry::SE2WithCovariance& b) {
  const Eigen::Vector3d off = (a.mean.inverse() * b.mean).Log();
  return off.dot((a.covariance + b.covariance).inverse() * off);
}

/// Largest factor by which agreeing closures may raise the variances on the path between their
/// ends, in total: standard deviations by 30. A worse odometry is faulty, and closures that need
/// more are wrong.
constexpr double kMostUnderstated = 1000.0;

/// Solves until the closures fit or the estimates no longer change.
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

  Waiting one{closure.id, from.node, to.node,
              compound(compound(from.node_T_end, closure.from_T_to), inverse(to.node_T_end)),
              closure.log10_false_alarm};
  const auto known = map.graph.relative(one.a, one.b);
  if (!known) return {kRefused, "the graph does not determine its ends"};
  const double off = squared_distance(*known, one.a_T_b);
  const bool is_expected = off <= kConsistent;
  one.misstatement = std::clamp(off / 3.0, 1.0, kMostMisstated);
  if (is_expected && join({&one, 1}, map)) {
    take_expected(map);
    return {kAccepted, {}};
  }
  if (closure.source == "manual") {
    Decision decision = overrule({&one, 1}, map);
    if (decision.status == kAccepted) take_expected(map);
    return decision;
  }

  // It contradicts the graph: it waits.
  if (waiting_.size() == kMostWaiting) waiting_.erase(waiting_.begin());
  waiting_.push_back(one);
  const std::vector<Waiting> agreeing = agreeing_with(one, map);
  std::vector<Witness> witnesses;
  witnesses.reserve(agreeing.size());
  for (const Waiting& each : agreeing)
    witnesses.push_back(
        {map.graph.node(each.a).along_m, map.graph.node(each.b).along_m, each.log10_false_alarm});
  if (decades(witnesses) < kBeyondDoubt)
    return {kWaiting, "it contradicts the graph: others must agree with it"};

  Decision decision = overrule(agreeing, map);
  if (decision.status != kAccepted) return {kWaiting, std::move(decision.reason)};
  std::erase_if(waiting_, [&](const Waiting& other) {
    return std::ranges::find(agreeing, other.id, &Waiting::id) != agreeing.end();
  });
  take_expected(map);
  return decision;
}

/// Accepts waiting closures that are now within the graph's uncertainty.
void Closures::take_expected(GlobalMap& map) {
  const auto counts = [&](const Waiting& one) {
    const auto known = map.graph.relative(one.a, one.b);
    return known && squared_distance(*known, one.a_T_b) <= kConsistent && join({&one, 1}, map);
  };
  while (std::erase_if(waiting_, counts) > 0) {
  }
}

/// The largest set of waiting closures that includes the newest and in which all agree with each
/// other.
std::vector<Closures::Waiting> Closures::agreeing_with(const Waiting& one,
                                                       const GlobalMap& map) const {
  std::vector<std::uint64_t> agrees(waiting_.size());
  for (std::size_t i = 0; i < waiting_.size(); ++i) {
    if (!agree(one, waiting_[i], map)) continue;
    for (std::size_t k = 0; k < i; ++k) {
      if (!agree(waiting_[i], waiting_[k], map)) continue;
      agrees[i] |= std::uint64_t{1} << k;
      agrees[k] |= std::uint64_t{1} << i;
    }
  }

  std::vector<Waiting> set;
  for (const std::size_t i : largest_agreement(agrees, waiting_.size() - 1))
    set.push_back(waiting_[i]);
  return set;
}

/// Whether the loop a -> b -> other b -> other a -> a closes. Both give the graph's understatement;
/// variances that were raised already count as raised.
bool Closures::agree(const Waiting& one, const Waiting& other, const GlobalMap& map) const {
  const double misstatement = std::min(one.misstatement, other.misstatement);
  const auto between = [&](NodeIndex from, NodeIndex to) {
    if (from == to) return std::optional(geometry::SE2WithCovariance{});
    auto relative = map.graph.relative(from, to);
    if (!relative) return relative;
    const auto [from_m, to_m] =
        std::minmax({map.graph.node(from).along_m, map.graph.node(to).along_m});
    relative->covariance *= std::max(1.0, misstatement / understated_.least(from_m, to_m));
    return relative;
  };
  const auto b_T_b = between(one.b, other.b);
  const auto a_T_a = between(one.a, other.a);
  if (!b_T_b || !a_T_a) return false;
  const auto one_way = compound(one.a_T_b, *b_T_b);
  const auto other_way = compound(*a_T_a, other.a_T_b);
  const double spread_m2 =
      (one_way.covariance + other_way.covariance).topLeftCorner<2, 2>().trace();
  return spread_m2 <= kMostSpread_m * kMostSpread_m &&
         squared_distance(one_way, other_way) <= kConsistent;
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

/// The path between the ends of closures.
Closures::Stretch Closures::stretch_of(std::span<const Waiting> closures, const GlobalMap& map) {
  Stretch stretch{closures.front().a, closures.front().a};
  for (const Waiting& one : closures) {
    for (const NodeIndex node : {one.a, one.b}) {
      const double along_m = map.graph.node(node).along_m;
      if (along_m < map.graph.node(stretch.first).along_m) stretch.first = node;
      if (along_m > map.graph.node(stretch.last).along_m) stretch.last = node;
    }
  }
  stretch.from_m = map.graph.node(stretch.first).along_m;
  stretch.to_m = map.graph.node(stretch.last).along_m;
  return stretch;
}

/// Ratio of the squared error at the median closure's ends to the variance that the graph states (3
/// degrees of freedom); none if the graph leaves the ends undetermined.
std::optional<double> Closures::median_ratio(std::span<const Waiting> closures,
                                             const GlobalMap& map) {
  std::vector<double> ratios;
  for (const Waiting& one : closures) {
    const auto known = map.graph.relative(one.a, one.b);
    if (known) ratios.push_back(squared_distance(*known, one.a_T_b) / 3.0);
  }
  if (ratios.empty()) return std::nullopt;
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  return *middle;
}

/// Accepts closures against the graph: the variances of the path between their ends are raised if
/// the closures do not fit otherwise. Earlier raises on a part of that path count: factors of
/// nested loops are not multiplied.
Closures::Decision Closures::overrule(std::span<const Waiting> closures, GlobalMap& map) {
  using enum model::LoopResult::Status;
  const Stretch stretch = stretch_of(closures, map);
  const std::optional<double> ratio = median_ratio(closures, map);
  if (join(closures, map)) return {kAccepted, {}};
  if (!ratio) return {kRefused, "the graph does not determine its ends"};

  const double least = understated_.least(stretch.from_m, stretch.to_m);
  const double factor = std::min(kMostUnderstated, std::max(1.0, *ratio) * least);
  const auto share_at = [&](double along_m) {
    const double before = understated_.at(along_m);
    return before / std::max(before, factor);
  };
  map.graph.checkpoint();
  map.graph.relax(stretch.first, stretch.last, share_at);
  if (join(closures, map)) {
    understated_.raise(stretch.from_m, stretch.to_m, factor);
    return {kAccepted,
            "the variances of " + std::to_string(std::lround(stretch.to_m - stretch.from_m)) +
                " m of path are " + std::to_string(std::lround(factor)) + " times those stated"};
  }
  map.graph.relax(stretch.first, stretch.last,
                  [&](double along_m) { return 1.0 / share_at(along_m); });
  return {kRefused, "the rest of the graph contradicts it"};
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
