#include "services/landmark_extractor/view/planar_view.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/geometry/se2.hpp"
#include "services/landmark_extractor/view/range_bytes.hpp"

namespace understory::landmark_extractor::view {
namespace {

/// The returns of one bin [m]; 0 = none.
struct Met {
  double nearest_m = 0.0;
  double farthest_m = 0.0;
};

/// Bins from right to left, the first beam in the middle of the first one.
std::vector<Met> bins_of(const planar::Beams& scan) {
  const double first_rad = scan.beams.front().bearing_rad;
  const double width_rad = scan.beams.back().bearing_rad - first_rad;
  // The first beam may be repeated as the last.
  const double turn = 2.0 * std::numbers::pi / scan.step_rad + 1e-6;
  const double count = std::min(turn, std::floor(width_rad / scan.step_rad + 0.5) + 1.0);

  std::vector<Met> bins(static_cast<std::size_t>(std::max(1.0, count)));
  for (const planar::Beam& beam : scan.beams) {
    const double place = std::floor((beam.bearing_rad - first_rad) / scan.step_rad + 0.5);
    if (!beam.is_return() || !(place >= 0.0 && place < static_cast<double>(bins.size()))) continue;
    Met& bin = bins[static_cast<std::size_t>(place)];
    bin.farthest_m = std::max(bin.farthest_m, beam.range_m);
    if (bin.nearest_m == 0.0 || beam.range_m < bin.nearest_m) bin.nearest_m = beam.range_m;
  }
  return bins;
}

/// Positions of the laser at both ends of the bins: it moved at a constant rate between returns. A
/// beam without return has no position.
struct Ends {
  Eigen::Vector2d right_m;
  Eigen::Vector2d left_m;
};
Ends ends_of(const planar::Beams& scan, double width_rad) {
  const auto first = std::ranges::find_if(scan.beams, &planar::Beam::is_return);
  const auto last = std::find_if(scan.beams.rbegin(), scan.beams.rend(),
                                 [](const planar::Beam& beam) { return beam.is_return(); });
  if (first == scan.beams.end()) return {scan.sensor_m.head<2>(), scan.sensor_m.head<2>()};
  const double between_rad = last->bearing_rad - first->bearing_rad;
  if (!(between_rad > 0.0)) return {first->origin_m, first->origin_m};
  const Eigen::Vector2d per_rad = (last->origin_m - first->origin_m) / between_rad;
  const double begin_rad = scan.beams.front().bearing_rad - 0.5 * scan.step_rad;
  const Eigen::Vector2d right_m = first->origin_m + (begin_rad - first->bearing_rad) * per_rad;
  return {right_m, right_m + width_rad * per_rad};
}

/// Whether later beams are farther to the left.
bool goes_leftward(const planar::Beams& scan) {
  const planar::Beam* before = nullptr;
  for (const planar::Beam& beam : scan.beams) {
    if (!beam.is_return()) continue;
    if (before != nullptr && beam.time_s != before->time_s) return beam.time_s > before->time_s;
    before = &beam;
  }
  return true;
}

}  // namespace

model::ViewRanges planar_view(const planar::Beams& scan, double range_m) {
  model::ViewRanges ranges;
  if (scan.beams.empty() || !(scan.step_rad > 0.0)) return ranges;
  std::vector<Met> bins = bins_of(scan);
  const double width_rad = scan.step_rad * static_cast<double>(bins.size());
  const bool is_leftward = goes_leftward(scan);
  if (!is_leftward) std::ranges::reverse(bins);
  const Ends ends = ends_of(scan, width_rad);
  const double right_rad = scan.beams.front().bearing_rad - 0.5 * scan.step_rad;

  ranges.sensor_m = is_leftward ? ends.left_m : ends.right_m;
  ranges.turn_m = is_leftward ? ends.left_m - ends.right_m : ends.right_m - ends.left_m;
  ranges.first_bearing_rad = geometry::wrap_angle(is_leftward ? right_rad : right_rad + width_rad);
  ranges.step_rad = is_leftward ? scan.step_rad : -scan.step_rad;
  ranges.beam_step_rad = scan.step_rad;
  ranges.range_step_m = step_for(range_m);
  for (const Met& bin : bins) {
    ranges.free.push_back(rounded_down(bin.nearest_m, ranges.range_step_m));
    ranges.hidden.push_back(bin.nearest_m > 0.0 ? rounded_up(bin.farthest_m, ranges.range_step_m)
                                                : 0);
  }
  return ranges;
}

}  // namespace understory::landmark_extractor::view
