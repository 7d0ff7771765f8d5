#include "common/bag/static_transforms.hpp"

#include <algorithm>
#include <set>

namespace understory::bag {

void StaticTransforms::add(const Pose& parent_T_child) {
  if (parent_T_child.child_frame.empty() ||
      parent_T_child.child_frame == parent_T_child.header.frame)
    return;
  links_[parent_T_child.child_frame] = {parent_T_child.header.frame, parent_T_child.pose};
}

void StaticTransforms::watch(const Pose& parent_T_child) {
  if (parent_T_child.child_frame.empty() ||
      parent_T_child.child_frame == parent_T_child.header.frame)
    return;
  constexpr double kMoved_m = 1e-3;
  constexpr double kTurned_rad = 1e-4;
  const auto [entry, is_new] = watched_.try_emplace(
      parent_T_child.child_frame, Watched{{parent_T_child.header.frame, parent_T_child.pose}});
  if (is_new) return;
  const Eigen::Isometry3d apart =
      entry->second.first.parent_T_child.inverse() * parent_T_child.pose;
  // A NaN is no place either.
  const bool is_same = parent_T_child.header.frame == entry->second.first.parent &&
                       apart.translation().norm() <= kMoved_m &&
                       Eigen::AngleAxisd(apart.linear()).angle() <= kTurned_rad;
  entry->second.has_moved |= !is_same;
}

std::size_t StaticTransforms::take_watched() {
  const std::size_t before = links_.size();
  for (const auto& [child, seen] : watched_) {
    if (!seen.has_moved) links_.try_emplace(child, seen.first);
  }
  watched_.clear();
  return links_.size() - before;
}

std::vector<std::pair<std::string, Eigen::Isometry3d>> StaticTransforms::ancestors(
    const std::string& frame) const {
  std::vector<std::pair<std::string, Eigen::Isometry3d>> chain{
      {frame, Eigen::Isometry3d::Identity()}};
  // A tree of n links has no longer chain; transforms in a circle do.
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const auto link = links_.find(chain.back().first);
    if (link == links_.end()) break;
    chain.emplace_back(link->second.parent, link->second.parent_T_child * chain.back().second);
  }
  return chain;
}

std::optional<Eigen::Isometry3d> StaticTransforms::find(const std::string& to,
                                                        const std::string& from) const {
  const auto above_from = ancestors(from);
  for (const auto& [frame, frame_T_to] : ancestors(to)) {
    const auto common = std::ranges::find(above_from, frame, [](const auto& a) { return a.first; });
    if (common != above_from.end()) return frame_T_to.inverse() * common->second;
  }
  return std::nullopt;
}

bool StaticTransforms::has(const std::string& frame) const {
  const auto names = frames();
  return std::ranges::find(names, frame) != names.end();
}

std::vector<std::string> StaticTransforms::frames() const {
  std::set<std::string> names;
  for (const auto& [child, link] : links_) {
    names.insert(child);
    names.insert(link.parent);
  }
  return {names.begin(), names.end()};
}

}  // namespace understory::bag
