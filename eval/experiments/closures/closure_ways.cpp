#include "eval/experiments/closures/closure_ways.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <bitset>
#include <cmath>

#include "eval/experiments/closures/plane_chain.hpp"
#include "services/geoslam_mapper/smoothing/closures.hpp"

namespace understory::eval::experiments::closures {
namespace {

namespace smoothing = geoslam_mapper::smoothing;
using geometry::SE2;

/// Rounds of a robust cost at most, and the change of a pose [m or rad] at which one ends.
constexpr int kRounds = 60;
constexpr double kStill = 1e-4;

PlaneChain chain_of(const ClosureDrive& drive, double understated = 1.0) {
  return {drive.measured, understated * drive.covariance};
}

std::vector<WeightedClosure> closures_of(const ClosureDrive& drive, double weight) {
  std::vector<WeightedClosure> closures;
  for (const SentClosure& one : drive.sent)
    closures.push_back({one.from, one.to, between_nodes(one), weight});
  return closures;
}

/// Accepted are those that fit the graph at the end.
WayResult by_fit(const PlaneChain& chain, const std::vector<WeightedClosure>& closures) {
  WayResult result;
  for (const WeightedClosure& one : closures)
    result.fates.push_back(chain.chi2(one) <= kFits ? Fate::kAccepted : Fate::kRefused);
  result.poses = chain.poses();
  return result;
}

/// Accepted are those that count.
WayResult by_weight(PlaneChain& chain, const std::vector<WeightedClosure>& closures) {
  chain.solve(closures);
  WayResult result;
  for (const WeightedClosure& one : closures)
    result.fates.push_back(one.weight > 0.5 ? Fate::kAccepted : Fate::kRefused);
  result.poses = chain.poses();
  return result;
}

// ------------------------------------------------------------------------------ shipped

void add_next_node(const ClosureDrive& drive, std::vector<smoothing::NodeIndex>& nodes,
                   smoothing::GlobalMap& map) {
  if (nodes.empty()) {
    nodes.push_back(map.graph.add_node({}, false, true));
    return;
  }
  const SE2& step = drive.measured[nodes.size() - 1];
  smoothing::CentreMotion motion;
  motion.from = nodes.back();
  motion.from_T_to = {step, drive.covariance};
  nodes.push_back(map.graph.add_node(map.graph.pose(nodes.back()) * step, false));
  map.graph.add_motion(motion, nodes.back());
}

// ------------------------------------------------------------------------------ maximum clique

constexpr std::size_t kMostClosures = 512;
using Set = std::bitset<kMostClosures>;

/// Branch and bound; the bound is the number of colours that neighbours need (Tomita 2003).
class Clique {
 public:
  explicit Clique(std::vector<Set> agrees) : agrees_(std::move(agrees)) {}
  Set largest() {
    Set all;
    for (std::size_t i = 0; i < agrees_.size(); ++i) all.set(i);
    grow(Set(), 0, all);
    return best_;
  }

 private:
  void grow(const Set& set, std::size_t size, Set candidates) {
    if (--steps_left_ < 0) return;
    if (size > best_size_) {
      best_size_ = size;
      best_ = set;
    }
    const auto [order, colours] = coloured(candidates);
    for (std::size_t i = order.size(); i-- > 0;) {
      if (size + colours[i] <= best_size_) return;
      Set larger = set;
      larger.set(order[i]);
      grow(larger, size + 1, candidates & agrees_[order[i]]);
      candidates.reset(order[i]);
    }
  }
  /// Members by colour: no two of one colour agree.
  std::pair<std::vector<std::size_t>, std::vector<std::size_t>> coloured(Set left) const {
    std::vector<std::size_t> order, colours;
    for (std::size_t colour = 1; left.any(); ++colour) {
      Set open = left;
      for (std::size_t i = open._Find_first(); i < kMostClosures; i = open._Find_next(i)) {
        open &= ~agrees_[i];
        left.reset(i);
        order.push_back(i);
        colours.push_back(colour);
      }
    }
    return {order, colours};
  }

  std::vector<Set> agrees_;
  Set best_;
  std::size_t best_size_ = 0;
  long steps_left_ = 2'000'000;
};

/// Whether a -> b -> other b -> other a -> a closes (Mangelson et al. 2018, eq. 5).
bool are_consistent(const WeightedClosure& one, const WeightedClosure& other,
                    const PlaneChain& chain) {
  const auto one_way = compound(one.a_T_b, chain.odometry(one.b, other.b));
  const auto other_way = compound(chain.odometry(one.a, other.a), other.a_T_b);
  const Eigen::Vector3d off = (one_way.mean.inverse() * other_way.mean).Log();
  return off.dot((one_way.covariance + other_way.covariance).inverse() * off) <= kFits;
}

/// Pairwise consistency where variances of the odometry are so many times those stated.
WayResult consistent_pairs(const ClosureDrive& drive, double understated) {
  PlaneChain chain = chain_of(drive, understated);
  std::vector<WeightedClosure> closures = closures_of(drive, 0.0);
  std::vector<Set> agrees(closures.size());
  for (std::size_t i = 0; i < closures.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (!are_consistent(closures[i], closures[k], chain)) continue;
      agrees[i].set(k);
      agrees[k].set(i);
    }
  }

  const Set chosen = Clique(agrees).largest();
  for (std::size_t i = 0; i < closures.size(); ++i) closures[i].weight = chosen[i] ? 1.0 : 0.0;
  return by_weight(chain, closures);
}

/// Dynamic covariance scaling with the parameter `phi`.
WayResult scaled(const ClosureDrive& drive, double phi) {
  PlaneChain chain = chain_of(drive);
  std::vector<WeightedClosure> closures = closures_of(drive, 1.0);
  for (int round = 0; round < kRounds; ++round) {
    for (WeightedClosure& one : closures) {
      const double scale = std::min(1.0, 2.0 * phi / (phi + chain.chi2(one)));
      one.weight = scale * scale;
    }
    if (chain.step(closures) < kStill) break;
  }
  return by_fit(chain, closures);
}

}  // namespace

WayResult shipped(const ClosureDrive& drive) {
  smoothing::GlobalMap map{geoslam_mapper::SmoothingMapperParameters{}};
  smoothing::Closures closures;
  std::vector<smoothing::NodeIndex> nodes;
  WayResult result;
  using Status = model::LoopResult::Status;
  std::vector<Status> told;
  for (const SentClosure& one : drive.sent) {
    while (nodes.size() <= one.to) add_next_node(drive, nodes, map);
    (void)map.graph.solve();
    told.push_back(closures
                       .take(one.closure,
                             {nodes[one.from], {one.from_T_end, Eigen::Matrix3d::Zero()}},
                             {nodes[one.to], {one.to_T_end, Eigen::Matrix3d::Zero()}}, map)
                       .status);
  }
  while (nodes.size() < drive.truth.size()) add_next_node(drive, nodes, map);
  (void)map.graph.solve();

  for (std::size_t i = 0; i < told.size(); ++i) {
    const bool counts = map.graph.has_closure(drive.sent[i].closure.id);
    const Fate otherwise = told[i] == Status::kWaiting ? Fate::kWaiting : Fate::kRefused;
    result.fates.push_back(counts ? Fate::kAccepted : otherwise);
  }
  for (const smoothing::NodeIndex node : nodes) result.poses.push_back(map.graph.pose(node));
  return result;
}

WayResult odometry_alone(const ClosureDrive& drive) {
  PlaneChain chain = chain_of(drive);
  return by_weight(chain, closures_of(drive, 0.0));
}

WayResult right_alone(const ClosureDrive& drive) {
  PlaneChain chain = chain_of(drive);
  std::vector<WeightedClosure> closures = closures_of(drive, 0.0);
  for (std::size_t i = 0; i < closures.size(); ++i)
    closures[i].weight = drive.sent[i].kind == Kind::kRight ? 1.0 : 0.0;
  return by_weight(chain, closures);
}

WayResult pairwise_consistency(const ClosureDrive& drive) { return consistent_pairs(drive, 1.0); }
WayResult pairwise_consistency_wide(const ClosureDrive& drive) {
  return consistent_pairs(drive, 100.0);
}

WayResult graduated_non_convexity(const ClosureDrive& drive) {
  PlaneChain chain = chain_of(drive);
  std::vector<WeightedClosure> closures = closures_of(drive, 1.0);
  chain.solve(closures);
  double largest = 0.0;
  for (const WeightedClosure& one : closures) largest = std::max(largest, chain.chi2(one));
  if (largest <= kFits) return by_weight(chain, closures);

  // Eq. 14 for the weights; mu grows by 1.4 from where the cost is convex (remark 5).
  double mu = kFits / std::max(2.0 * largest - kFits, 1e-9);
  for (int round = 0; round < 100; ++round, mu *= 1.4) {
    bool is_binary = true;
    for (WeightedClosure& one : closures) {
      const double chi2 = chain.chi2(one);
      const bool is_out = chi2 >= (mu + 1.0) / mu * kFits;
      const bool is_in = chi2 <= mu / (mu + 1.0) * kFits;
      const double between = std::sqrt(kFits * mu * (mu + 1.0) / chi2) - mu;
      one.weight = is_out ? 0.0 : is_in ? 1.0 : between;
      is_binary = is_binary && (is_out || is_in);
    }
    if (is_binary && round > 0) break;
    chain.solve(closures, 3);
  }
  return by_weight(chain, closures);
}

WayResult dynamic_covariance_scaling(const ClosureDrive& drive) { return scaled(drive, 1.0); }
WayResult dynamic_covariance_scaling_wide(const ClosureDrive& drive) {
  return scaled(drive, 3000.0);
}

WayResult max_mixture(const ClosureDrive& drive) {
  // The logarithms of both densities are equal at chi^2 = 62 (3 dimensions).
  constexpr double kNullInformation = 1e-9;
  PlaneChain chain = chain_of(drive);
  std::vector<WeightedClosure> closures = closures_of(drive, 1.0);
  for (int round = 0; round < kRounds; ++round) {
    for (WeightedClosure& one : closures) {
      const double chi2 = chain.chi2(one);
      const bool is_null = chi2 * (1.0 - kNullInformation) > -3.0 * std::log(kNullInformation);
      one.weight = is_null ? kNullInformation : 1.0;
    }
    if (chain.step(closures) < kStill) break;
  }
  return by_fit(chain, closures);
}

double ate_m(const std::vector<SE2>& poses, const std::vector<SE2>& truth) {
  Eigen::Vector2d middle(0.0, 0.0), true_middle(0.0, 0.0);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    middle += poses[i].translation() / static_cast<double>(poses.size());
    true_middle += truth[i].translation() / static_cast<double>(poses.size());
  }
  double sine = 0.0, cosine = 0.0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Vector2d a = poses[i].translation() - middle;
    const Eigen::Vector2d b = truth[i].translation() - true_middle;
    cosine += a.dot(b);
    sine += a.x() * b.y() - a.y() * b.x();
  }
  const SE2 turn(0.0, 0.0, std::atan2(sine, cosine));
  double sum = 0.0;
  for (std::size_t i = 0; i < poses.size(); ++i)
    sum += (turn * (poses[i].translation() - middle) - truth[i].translation() + true_middle)
               .squaredNorm();
  return std::sqrt(sum / static_cast<double>(poses.size()));
}

}  // namespace understory::eval::experiments::closures
