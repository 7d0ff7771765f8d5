#include "services/loop_closer/place_window.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

namespace understory::loop_closer {
namespace {

/// The mapper's motion and the keyframer's differ by more than these: the map was corrected.
constexpr double kCorrectedM = 0.5;
constexpr double kCorrectedRad = 0.05;
/// Without tracking, a longer step between two keyframes is a correction of the map.
constexpr double kLongestStepM = 200.0;

/// In a window of at least this many keyframes, stems detected only once are ignored: false
/// detections rarely repeat, trunks do. In a shorter window all are used.
constexpr std::size_t kManyKeyframes = 4;
constexpr double kSeenAgain = 2.0;

/// A stem that several keyframes detected.
struct JoinedStem {
  Eigen::Vector2d sum_m = Eigen::Vector2d::Zero();
  double count = 0.0;
  double diameter_sum_m = 0.0;
  double diameter_count = 0.0;
  model::LandmarkId landmark = 0;

  Eigen::Vector2d position_m() const { return sum_m / count; }
};

}  // namespace

bool PlaceWindow::was_corrected(const model::Keyframe& keyframe,
                                const geometry::SE2& last_T_base) const {
  if (last_T_base.translation().norm() > kLongestStepM) return true;
  if (!keyframe.previous_T_base || keyframe.sequence != last_->sequence + 1) return false;
  const Eigen::Vector3d off = (keyframe.previous_T_base->inverse() * last_T_base).Log();
  return off.head<2>().norm() > kCorrectedM || std::abs(off.z()) > kCorrectedRad;
}

WindowStep PlaceWindow::add(const model::Keyframe& keyframe, const model::MapUpdate& update) {
  if (last_) {
    const geometry::SE2 last_T_base = last_->map_T_base.inverse() * update.map_T_vehicle;
    if (was_corrected(keyframe, last_T_base)) restart();
    along_m_ += std::min(kLongestStepM, last_T_base.translation().norm());
  }
  last_ = WindowEnd{keyframe.sequence, update.map_T_vehicle};
  const WindowStep step = seen_.empty() ? WindowStep::kBegun : WindowStep::kWentOn;

  Seen seen;
  seen.along_m = along_m_;
  const geometry::SE2 map_T_centre = update.map_T_vehicle * keyframe.centre_T_base().inverse();
  for (const model::KeyframeLandmark& landmark : keyframe.landmarks) {
    const bool is_trunk = landmark.kind == model::LandmarkKind::kTrunk;
    seen.stems.push_back(
        {map_T_centre * landmark.position_m, is_trunk ? 2.0 * landmark.radius_m : 0.0, 0});
  }
  for (const model::Association& pair : update.associations)
    if (pair.keyframe_landmark < seen.stems.size())
      seen.stems[pair.keyframe_landmark].landmark = pair.landmark_id;
  seen_.push_back(std::move(seen));
  while (seen_.front().along_m < along_m_ - parameters_.window_m) seen_.pop_front();
  return step;
}

std::vector<LevelStem> PlaceWindow::stems() const {
  std::vector<JoinedStem> joined;
  for (const Seen& seen : seen_) {
    for (const SeenStem& stem : seen.stems) {
      auto same = std::ranges::find_if(joined, [&](const JoinedStem& other) {
        if (stem.landmark != 0 && other.landmark != 0) return stem.landmark == other.landmark;
        return (other.position_m() - stem.position_m).norm() < parameters_.merge_m;
      });
      if (same == joined.end()) same = joined.insert(joined.end(), JoinedStem{});
      same->sum_m += stem.position_m;
      same->count += 1.0;
      if (stem.landmark != 0) same->landmark = stem.landmark;
      if (stem.diameter_m > 0.0) {
        same->diameter_sum_m += stem.diameter_m;
        same->diameter_count += 1.0;
      }
    }
  }

  std::vector<LevelStem> stems;
  if (!last_) return stems;
  const auto is_seen_again = [](const JoinedStem& one) { return one.count >= kSeenAgain; };
  if (seen_.size() >= kManyKeyframes &&
      std::ranges::count_if(joined, is_seen_again) >= parameters_.min_stems)
    std::erase_if(joined, std::not_fn(is_seen_again));
  const geometry::SE2 base_T_map = last_->map_T_base.inverse();
  for (const JoinedStem& one : joined) {
    const double diameter_m =
        one.diameter_count > 0.0 ? one.diameter_sum_m / one.diameter_count : 0.0;
    stems.push_back({base_T_map * one.position_m(), diameter_m});
  }
  std::ranges::sort(stems, {}, [](const LevelStem& stem) { return stem.position_m.squaredNorm(); });
  const auto most = static_cast<std::size_t>(parameters_.most_stems);
  if (stems.size() > most) stems.resize(most);
  return stems;
}

}  // namespace understory::loop_closer
