#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "common/geometry/trajectory_error.hpp"
#include "deploy/cli/accuracy_report.hpp"

namespace understory::cli {
namespace {

using Json = nlohmann::ordered_json;

/// Lengths of path for RPE [m].
constexpr std::array kPathLengths_m{10.0, 100.0, 1000.0};

std::uint64_t count_of(const DriveAccuracy& accuracy, model::MapUpdateStatus status) {
  const auto found = accuracy.updates.find(status);
  return found == accuracy.updates.end() ? 0 : found->second;
}

/// Messages reported as missing by the processes.
struct Drops {
  std::int64_t lost = 0;
  std::int64_t malformed = 0;
  std::int64_t dropped = 0;
};

Drops drops_of(const DriveAccuracy& accuracy) {
  Drops drops;
  for (const auto& [process, health] : accuracy.last_health) {
    for (const auto& channel : health.channels) {
      if (channel.output != 0) continue;
      drops.lost += channel.lost;
      drops.malformed += channel.malformed;
      drops.dropped += channel.dropped;
    }
  }
  return drops;
}

Json ate_json(const std::vector<ComparedPose>& poses) {
  const auto error = geometry::aligned_error(pairs_of(poses));
  if (!error) return nullptr;
  return {{"poses", poses.size()}, {"rms_m", error->rms_m}, {"largest_m", error->largest_m}};
}

Json rpe_json(const std::vector<ComparedPose>& poses) {
  Json list = Json::array();
  const auto pairs = pairs_of(poses);
  for (const double length_m : kPathLengths_m) {
    const auto error = geometry::relative_error(pairs, length_m);
    const auto number = [&](double geometry::RelativeError::*member) {
      return error ? Json(*error.*member) : Json();
    };
    list.push_back(
        {{"length_m", length_m},
         {"pairs", error ? error->pairs : 0},
         {"translation_rms_m", number(&geometry::RelativeError::translation_rms_m)},
         {"translation_mean_percent", number(&geometry::RelativeError::translation_mean_percent)},
         {"rotation_rms_deg", number(&geometry::RelativeError::rotation_rms_deg)},
         {"rotation_mean_deg_per_m", number(&geometry::RelativeError::rotation_mean_deg_per_m)}});
  }
  return list;
}

Json nees_json(const std::vector<ComparedPose>& poses) {
  const auto summary = geometry::summary_of(nees_of(poses));
  if (!summary) return nullptr;
  return {{"poses", summary->count},
          {"mean", summary->mean},
          {"median", summary->median},
          {"share_in_95_band", summary->share_in_band},
          {"share_above_95_band", summary->share_above}};
}

/// A measure of the live poses and of the keyframes.
template <class Measure>
Json of_both(const DriveAccuracy& accuracy, const Measure& measure) {
  return {{"live", measure(accuracy.live)}, {"keyframes", measure(accuracy.keyframes)}};
}

Json closures_json(const ClosureCounts& closures) {
  return {{"sent", closures.sent},       {"accepted", closures.accepted},
          {"waiting", closures.waiting}, {"revoked", closures.revoked},
          {"refused", closures.refused}, {"refused_by_reason", Json(closures.refused_by_reason)}};
}

/// Wrong poses, and whether a process reported them; `told` is null where no process reported its
/// state.
Json wrong_json(const DriveAccuracy& accuracy) {
  std::size_t poses = 0;
  int told = 0;
  Json list = Json::array();
  for (const WrongStretch& stretch : accuracy.wrong_stretches) {
    poses += stretch.poses;
    if (stretch.was_told) ++told;
    list.push_back({{"from_utime", stretch.span.from_us},
                    {"to_utime", stretch.span.to_us},
                    {"poses", stretch.poses},
                    {"largest_error_m", stretch.largest_error_m},
                    {"told", stretch.was_told}});
  }
  const auto count = static_cast<double>(accuracy.wrong_stretches.size());
  return {{"stretches", accuracy.wrong_stretches.size()},
          {"poses", poses},
          {"told", accuracy.has_alarms ? Json(told) : Json()},
          {"share_told", accuracy.has_alarms && count > 0.0 ? Json(told / count) : Json()},
          {"list", std::move(list)}};
}

Json counts_json(const DriveAccuracy& accuracy) {
  const DriveCounts& counts = accuracy.counts;
  return {{"poses_by_status", Json(counts.poses_by_status)},
          {"reset_counter_steps", counts.reset_counter_steps},
          {"keyframes_sent", counts.keyframes_sent},
          {"keyframes_without_pose", counts.keyframes_without_pose},
          {"closures", closures_json(counts.closures)},
          {"wrong", wrong_json(accuracy)}};
}

/// Mean distance of landmarks to the nearest true one.
Json lpe_json(const LandmarkAccuracy& landmarks) {
  if (landmarks.errors_m.empty()) return nullptr;
  return 100.0 * mean(landmarks.errors_m);
}

Json doubles_json(const LandmarkAccuracy& landmarks) {
  if (landmarks.true_landmarks_m.empty()) return nullptr;
  return {{"pairs", landmarks.double_pairs}, {"at_a_true_one", landmarks.at_a_true_one}};
}

/// Bytes, the largest first.
Json bytes_json(const std::map<std::string, std::uint64_t>& bytes_by_channel) {
  std::vector<std::pair<std::string, std::uint64_t>> channels(bytes_by_channel.begin(),
                                                              bytes_by_channel.end());
  std::ranges::stable_sort(channels, std::greater(),
                           &std::pair<std::string, std::uint64_t>::second);
  Json list = Json::array();
  for (const auto& [channel, bytes] : channels)
    list.push_back({{"channel", channel}, {"bytes", bytes}});
  return list;
}

}  // namespace

Json accuracy_summary(const DriveAccuracy& accuracy) {
  const auto live = position_errors_m(accuracy.live);
  const auto keyframes = position_errors_m(accuracy.keyframes);
  const auto drops = drops_of(accuracy);

  return {{"scans", accuracy.scans},
          {"live_poses", live.size()},
          {"live_mean_cm", 100.0 * mean(live)},
          {"live_rmse_cm", 100.0 * rms(live)},
          {"live_max_cm", 100.0 * maximum(live)},
          {"keyframes", keyframes.size()},
          {"rpe_cm", 100.0 * mean(keyframes)},
          {"keyframes_rmse_cm", 100.0 * rms(keyframes)},
          {"keyframes_max_cm", 100.0 * maximum(keyframes)},
          {"landmarks", accuracy.landmarks.landmarks_m.size()},
          {"landmarks_compared", accuracy.landmarks.errors_m.size()},
          {"lpe_cm", lpe_json(accuracy.landmarks)},
          {"updates", count_of(accuracy, model::MapUpdateStatus::kFirstMap) +
                          count_of(accuracy, model::MapUpdateStatus::kUpdated)},
          {"updates_not_sure", count_of(accuracy, model::MapUpdateStatus::kNotSure)},
          {"updates_rolled_back", count_of(accuracy, model::MapUpdateStatus::kRolledBack)},
          {"lost", drops.lost},
          {"malformed", drops.malformed},
          {"dropped", drops.dropped},
          {"lost_by_the_log", accuracy.log_lost},
          {"map_tied_at", to_string(accuracy.tied_at)},
          {"ate", of_both(accuracy, ate_json)},
          {"rpe_by_path", of_both(accuracy, rpe_json)},
          {"nees", of_both(accuracy, nees_json)},
          {"counts", counts_json(accuracy)},
          {"doubles", doubles_json(accuracy.landmarks)},
          {"bytes_by_channel", bytes_json(accuracy.counts.bytes_by_channel)}};
}

}  // namespace understory::cli
