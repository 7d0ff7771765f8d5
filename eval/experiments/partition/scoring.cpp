#include "eval/experiments/partition/scoring.hpp"

#include <algorithm>
#include <cmath>

namespace understory::eval::experiments::partition {
namespace {

/// Root of a mean of squares.
struct RootMeanSquare {
  double sum = 0.0;
  double count = 0.0;

  void add(double squared) {
    sum += squared;
    count += 1.0;
  }
  double value() const { return count > 0.0 ? std::sqrt(sum / count) : 0.0; }
};

Trajectory::const_iterator find_time(const Trajectory& trajectory, model::Utime utime) {
  const auto found = std::lower_bound(
      trajectory.begin(), trajectory.end(), utime,
      [](const metrics::StampedPose& one, model::Utime at) { return one.utime < at; });
  return found != trajectory.end() && found->utime == utime ? found : trajectory.end();
}

}  // namespace

Distances distances(const Trajectory& a, const Trajectory& b, std::span<const model::Utime> cuts) {
  RootMeanSquare all;
  RootMeanSquare at_cuts;
  RootMeanSquare between;
  for (const metrics::StampedPose& one : a) {
    const auto other = find_time(b, one.utime);
    if (other == b.end()) continue;
    const double squared = (one.pose.translation() - other->pose.translation()).squaredNorm();
    all.add(squared);
    const bool is_cut = std::find(cuts.begin(), cuts.end(), one.utime) != cuts.end();
    (is_cut ? at_cuts : between).add(squared);
  }
  return {all.value(), at_cuts.value(), between.value()};
}

std::vector<CutEffect> effects(const Trajectory& cut, const Trajectory& uncut,
                               std::span<const model::Utime> cuts,
                               std::span<const double> landmarks) {
  std::vector<CutEffect> result;
  for (std::size_t i = 0; i < cuts.size(); ++i) {
    const auto at = find_time(cut, cuts[i]);
    if (at - cut.begin() < static_cast<std::ptrdiff_t>(kAround) ||
        cut.end() - at <= static_cast<std::ptrdiff_t>(kAround)) {
      continue;
    }
    const metrics::StampedPose& before = *(at - kAround);
    const metrics::StampedPose& behind = *(at + kAround);
    const auto uncut_before = find_time(uncut, before.utime);
    const auto uncut_behind = find_time(uncut, behind.utime);
    if (uncut_before == uncut.end() || uncut_behind == uncut.end()) continue;

    const geometry::SE2 motion = before.pose.inverse() * behind.pose;
    const geometry::SE2 step =
        (uncut_before->pose.inverse() * uncut_behind->pose).inverse() * motion;
    result.push_back({landmarks[i], step.translation().norm(), 1e3 * std::abs(step.theta())});
  }
  return result;
}

}  // namespace understory::eval::experiments::partition
