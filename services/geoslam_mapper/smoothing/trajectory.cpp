#include "services/geoslam_mapper/smoothing/trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Two bases of a node are one viewpoint within this share of the folding distance and angle.
constexpr double kApartShare = 0.25;
/// Number of bases deleted at a time.
constexpr std::size_t kForgotten = 256;
/// Most tears that are kept; only those of the last keyframes and around a revisited place matter.
constexpr std::size_t kMostTears = 1024;

}  // namespace

geometry::SE2 middle_of(const model::Keyframe& keyframe) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const geometry::SE2 base_T_centre = keyframe.centre_T_base().inverse();
  for (const model::KeyframeMember& member : keyframe.members)
    sum += (base_T_centre * member.centre_T_vehicle).coordinates();
  sum /= static_cast<double>(keyframe.members.size());
  return keyframe.centre_T_base() * geometry::SE2(sum.x(), sum.y(), sum.z());
}

Base base_of(const model::Keyframe& keyframe, NodeIndex node, bool is_origin) {
  return {node,
          keyframe.sequence,
          keyframe.utime,
          {keyframe.centre_T_base(), keyframe.members.front().covariance},
          middle_of(keyframe),
          is_origin};
}

void Trajectory::add(const Base& base, const PoseGraph& graph) {
  if (!add_viewpoint(base, graph)) return add_spare(base);
  bases_.push_back(base);
  ++accepted_;
}

void Trajectory::add_spare(Base base) {
  base.is_spare = true;
  bases_.push_back(base);
  ++accepted_;
  ++spare_;
  forget_oldest();
}

/// Beyond the limit, deletes many at a time.
void Trajectory::forget_oldest() {
  if (spare_ < kMostSpare + kForgotten) return;
  std::size_t forgotten = 0;
  std::erase_if(bases_, [&](const Base& base) {
    return base.is_spare && &base != &bases_.back() && forgotten++ < kForgotten;
  });
  spare_ -= std::min(forgotten, kForgotten);
}

/// Makes the base a viewpoint unless its node has one as near.
bool Trajectory::add_viewpoint(const Base& base, const PoseGraph& graph) {
  const double apart_m = kApartShare * fold_distance_m_;
  for (const std::uint32_t other : viewpoints_of(base.node)) {
    const geometry::SE2 between =
        viewpoints_[other].centre_T_middle.inverse() * base.centre_T_middle;
    if (between.translation().norm() < apart_m &&
        std::abs(between.theta()) < kApartShare * fold_angle_rad_) {
      return false;
    }
  }

  put({base.node, base.centre_T_middle, false}, graph);
  return true;
}

void Trajectory::put(const Viewpoint& viewpoint, const PoseGraph& graph) {
  auto number = static_cast<std::uint32_t>(viewpoints_.size());
  if (free_viewpoints_.empty()) {
    viewpoints_.push_back(viewpoint);
  } else {
    number = free_viewpoints_.back();
    free_viewpoints_.pop_back();
    viewpoints_[number] = viewpoint;
  }
  index(number, graph);
}

/// Numbers of a node's viewpoints.
std::span<const std::uint32_t> Trajectory::viewpoints_of(NodeIndex node) const {
  const auto found = indexed_.find(node);
  if (found == indexed_.end()) return {};
  return found->second.viewpoints;
}

/// Removes them from the node.
std::vector<std::uint32_t> Trajectory::take_viewpoints_of(NodeIndex node) {
  const auto found = indexed_.find(node);
  if (found == indexed_.end()) return {};
  std::vector<std::uint32_t> numbers = std::move(found->second.viewpoints);
  indexed_.erase(found);
  return numbers;
}

/// Their numbers are reused.
void Trajectory::drop_viewpoints(NodeIndex node) {
  for (const std::uint32_t viewpoint : take_viewpoints_of(node)) {
    grid_.remove(viewpoint);
    viewpoints_[viewpoint].is_free = true;
    free_viewpoints_.push_back(viewpoint);
  }
}

AwayBases Trajectory::put_away(NodeIndex node) {
  AwayBases away;
  const auto goes = [&](const Base& base) {
    return base.node == node && !base.is_origin && &base != &bases_.back();
  };
  std::copy_if(bases_.begin(), bases_.end(), std::back_inserter(away.bases), goes);
  std::erase_if(bases_, goes);
  spare_ -= static_cast<std::size_t>(
      std::ranges::count_if(away.bases, [](const Base& base) { return base.is_spare; }));

  for (const std::uint32_t number : viewpoints_of(node))
    away.centre_T_viewpoints.push_back(viewpoints_[number].centre_T_middle);
  drop_viewpoints(node);
  return away;
}

void Trajectory::bring_back(NodeIndex node, AwayBases away, const PoseGraph& graph) {
  spare_ += static_cast<std::size_t>(
      std::ranges::count_if(away.bases, [](const Base& base) { return base.is_spare; }));
  const auto were = static_cast<std::ptrdiff_t>(bases_.size());
  bases_.insert(bases_.end(), away.bases.begin(), away.bases.end());
  std::inplace_merge(bases_.begin(), bases_.begin() + were, bases_.end(),
                     [](const Base& a, const Base& b) { return a.utime < b.utime; });
  for (const geometry::SE2& centre_T_viewpoint : away.centre_T_viewpoints)
    put({node, centre_T_viewpoint, false}, graph);
}

void Trajectory::tear() {
  if (torn_.size() == kMostTears) torn_.erase(torn_.begin());
  torn_.push_back(accepted_ + 1);
}

bool Trajectory::is_torn(std::uint32_t a, std::uint32_t b) const {
  const auto after = std::upper_bound(torn_.begin(), torn_.end(), std::min(a, b));
  return after != torn_.end() && *after <= std::max(a, b);
}

void Trajectory::absorb(Trajectory other, NodeIndex first, const PoseGraph& graph) {
  for (Base& base : other.bases_) {
    base.node += first;
    base.is_origin = false;
  }
  const auto were = static_cast<std::ptrdiff_t>(bases_.size());
  bases_.insert(bases_.end(), other.bases_.begin(), other.bases_.end());
  std::inplace_merge(bases_.begin(), bases_.begin() + were, bases_.end(),
                     [](const Base& a, const Base& b) { return a.utime < b.utime; });
  spare_ += other.spare_;

  for (const Viewpoint& viewpoint : other.viewpoints_)
    if (!viewpoint.is_free) put({viewpoint.node + first, viewpoint.centre_T_middle, false}, graph);
}

void Trajectory::index(std::uint32_t viewpoint, const PoseGraph& graph) {
  const NodeIndex node = viewpoints_[viewpoint].node;
  const auto [entry, is_first] = indexed_.try_emplace(node);
  IndexedNode& indexed = entry->second;
  if (is_first) indexed.indexed_at = graph.pose(node);
  const Eigen::Vector2d& lever = viewpoints_[viewpoint].centre_T_middle.translation();
  indexed.lever_m = std::max(indexed.lever_m, lever.norm());
  indexed.viewpoints.push_back(viewpoint);
  grid_.put(viewpoint, indexed.indexed_at * lever);
}

void Trajectory::hand_over(const Retirement& retirement) {
  // Each viewpoint has a base that is not spare; the node's other bases are later than its first.
  std::size_t left = viewpoints_of(retirement.node).size();
  for (auto base = bases_.rbegin(); left > 0 && base != bases_.rend(); ++base) {
    if (base->node != retirement.node) continue;
    base->node = retirement.into;
    base->centre_T_base = compound(retirement.into_T_node, base->centre_T_base);
    base->centre_T_middle = retirement.into_T_node.mean * base->centre_T_middle;
    if (base->is_spare) continue;
    base->is_spare = true;
    ++spare_;
    --left;
  }

  drop_viewpoints(retirement.node);
  forget_oldest();
}

void Trajectory::tie(std::span<const Retirement> retired, const PoseGraph& graph) {
  const auto retirement_of = [&](NodeIndex node) {
    return std::find_if(retired.begin(), retired.end(),
                        [&](const Retirement& one) { return one.node == node; });
  };
  std::size_t left = 0;
  for (const Retirement& one : retired) left += viewpoints_of(one.node).size();
  for (auto base = bases_.rbegin(); left > 0 && base != bases_.rend(); ++base) {
    const auto one = retirement_of(base->node);
    if (one == retired.end()) continue;
    base->node = one->into;
    base->centre_T_base = compound(one->into_T_node, base->centre_T_base);
    base->centre_T_middle = one->into_T_node.mean * base->centre_T_middle;
    if (!base->is_spare) --left;
  }

  for (const Retirement& one : retired) {
    for (const std::uint32_t number : take_viewpoints_of(one.node)) {
      Viewpoint& viewpoint = viewpoints_[number];
      viewpoint.node = one.into;
      viewpoint.centre_T_middle = one.into_T_node.mean * viewpoint.centre_T_middle;
      index(number, graph);
    }
  }
}

void Trajectory::follow(const PoseGraph& graph) {
  for (const NodeIndex node : graph.moved_nodes()) {
    const auto found = indexed_.find(node);
    if (found == indexed_.end()) continue;
    IndexedNode& indexed = found->second;
    const geometry::SE2 now = graph.pose(node);
    const double rotated = std::abs(geometry::wrap_angle(now.theta() - indexed.indexed_at.theta()));
    const double moved_m = (now.translation() - indexed.indexed_at.translation()).norm();
    if (moved_m + indexed.lever_m * rotated < kStale_m) continue;
    indexed.indexed_at = now;
    for (const std::uint32_t viewpoint : indexed.viewpoints)
      grid_.put(viewpoint, now * viewpoints_[viewpoint].centre_T_middle.translation());
  }
}

geometry::SE2 Trajectory::pose(const Base& base, const PoseGraph& graph) const {
  if (base.is_origin) return {};
  return graph.pose(base.node) * base.centre_T_base.mean;
}

bool Trajectory::is_stationary(const model::Keyframe& keyframe) const {
  const geometry::SE2 driven = keyframe.members.front().centre_T_vehicle.inverse() *
                               keyframe.members.back().centre_T_vehicle;
  return driven.translation().norm() < fold_distance_m_ &&
         std::abs(driven.theta()) < fold_angle_rad_;
}

std::optional<NodeIndex> Trajectory::revisited(const geometry::SE2& map_T_middle,
                                               const PoseGraph& graph) const {
  std::optional<NodeIndex> best;
  double best_distance = fold_distance_m_;
  const double radius_m = best_distance + kStale_m;
  grid_.for_each_near(map_T_middle.translation(), radius_m, [&](std::uint32_t viewpoint) {
    const Viewpoint& there = viewpoints_[viewpoint];
    if (graph.node(there.node).is_condensed) return;
    const geometry::SE2 between = middle(there, graph).inverse() * map_T_middle;
    const double distance = between.translation().norm();
    const bool is_nearer =
        distance < best_distance || (distance == best_distance && best < there.node);
    if (!is_nearer || std::abs(between.theta()) > fold_angle_rad_) return;

    best = there.node;
    best_distance = distance;
  });
  return best;
}

std::optional<geometry::SE2WithCovariance> Trajectory::origin_T_first() const {
  const auto origin =
      std::find_if(bases_.begin(), bases_.end(), [](const Base& base) { return base.is_origin; });
  if (origin == bases_.end()) return std::nullopt;
  return inverse(origin->centre_T_base);
}

void Trajectory::keep_in_place(model::Utime utime, const Eigen::Vector2d& by_m,
                               const PoseGraph& graph) {
  for (Base& base : bases_) {
    if (base.utime > utime) return;
    const geometry::SE2 map_T_node = graph.pose(base.node);
    geometry::SE2& node_T_base = base.centre_T_base.mean;
    node_T_base = map_T_node.inverse() * geometry::SE2(by_m, 0.0) * map_T_node * node_T_base;
  }
}

geometry::SE2WithCovariance Trajectory::from_origin(
    const geometry::SE2WithCovariance& map_T_centre) const {
  const auto first = origin_T_first();
  if (!first) return map_T_centre;
  return compound(*first, {first->mean.inverse() * map_T_centre.mean, map_T_centre.covariance});
}

geometry::SE2WithCovariance Trajectory::centre_from_origin(NodeIndex node,
                                                           const PoseGraph& graph) const {
  return from_origin(graph.marginal(node));
}

void Trajectory::rebuild_index(const PoseGraph& graph) {
  indexed_.clear();
  grid_ = {};
  spare_ = 0;
  for (const Base& base : bases_) {
    (void)graph.node(base.node);  // Throws if the graph has no such node.
    if (base.is_spare) ++spare_;
  }
  for (std::uint32_t number = 0; number < viewpoints_.size(); ++number) {
    if (viewpoints_[number].is_free) continue;
    (void)graph.node(viewpoints_[number].node);
    index(number, graph);
  }
}

}  // namespace understory::geoslam_mapper::smoothing
