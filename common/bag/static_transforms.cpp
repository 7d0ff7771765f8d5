#include "common/bag/static_transforms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace understory::bag {
namespace {

std::string text_of(const std::string& parent, const Eigen::Isometry3d& parent_T_child) {
  const Eigen::Vector3d& p = parent_T_child.translation();
  const Eigen::Matrix3d& r = parent_T_child.linear();
  const auto degrees = [](double radians) { return radians * 180.0 / std::numbers::pi + 0.0; };
  return fmt::format("in {} at ({:.3f}, {:.3f}, {:.3f}) m, roll {:.2f} pitch {:.2f} yaw {:.2f} deg",
                     parent, p.x(), p.y(), p.z(), degrees(std::atan2(r(2, 1), r(2, 2))),
                     degrees(std::asin(std::clamp(-r(2, 0), -1.0, 1.0))),
                     degrees(std::atan2(r(1, 0), r(0, 0))));
}

}  // namespace

bool StaticTransforms::is_same(const Link& a, const Link& b) {
  constexpr double kMoved_m = 1e-3;
  constexpr double kTurned_rad = 1e-4;
  const Eigen::Isometry3d apart = a.parent_T_child.inverse() * b.parent_T_child;
  return a.parent == b.parent && apart.translation().norm() <= kMoved_m &&
         Eigen::AngleAxisd(apart.linear()).angle() <= kTurned_rad;
}

bool StaticTransforms::admits(const Pose& parent_T_child) {
  const std::string& child = parent_T_child.child_frame;
  if (child.empty() || child == parent_T_child.header.frame) return false;
  if (parent_T_child.pose.translation().allFinite()) return true;
  unusable_.insert(fmt::format("{} in {}: a transform whose numbers are no pose is left out", child,
                               parent_T_child.header.frame));
  return false;
}

void StaticTransforms::add(const Pose& parent_T_child) {
  if (!admits(parent_T_child)) return;
  const std::string& child = parent_T_child.child_frame;
  const Link link{parent_T_child.header.frame, parent_T_child.pose};
  const auto [entry, is_new] = links_.try_emplace(child, link);
  if (is_new) return;
  if (!is_same(entry->second, link))
    replaced_[child] =
        fmt::format("{}: two static transforms, {} and later {}: the later one counts", child,
                    text_of(entry->second.parent, entry->second.parent_T_child),
                    text_of(link.parent, link.parent_T_child));
  entry->second = link;
}

void StaticTransforms::watch(const Pose& parent_T_child) {
  if (!admits(parent_T_child)) return;
  const Link link{parent_T_child.header.frame, parent_T_child.pose};
  const auto [entry, is_new] = watched_.try_emplace(parent_T_child.child_frame, Watched{link});
  if (!is_new) entry->second.has_moved |= !is_same(entry->second.first, link);
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
  // A chain in a tree of n links has at most n links; a cycle would be endless.
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

std::vector<std::string> StaticTransforms::remarks() const {
  std::vector<std::string> lines(unusable_.begin(), unusable_.end());
  for (const auto& [child, line] : replaced_) lines.push_back(line);
  return lines;
}

}  // namespace understory::bag
