#include "services/viewer/scene.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace understory::viewer {
namespace {

constexpr std::size_t kMostLogLines = 500;
constexpr std::size_t kMostScanPoints = 20'000;
/// Poses that come slower than 3 Hz are silent after so many of their intervals, but not later than
/// kLatestSilence_us.
constexpr std::int64_t kSilentPose_us = 1'000'000;
constexpr double kSilentIntervals = 3.0;
constexpr std::int64_t kLatestSilence_us = 10'000'000;
constexpr std::int64_t kAgePeriod_us = 10'000'000;
constexpr double kSigmas = 3.0;    ///< Of what is told to people.
constexpr double kUnsure_m = 1.0;  ///< A standard deviation above it is said to be unsure.
constexpr float kDrawEvery_m = 1.0F;
constexpr double kDrawEvery_rad = 0.05;
constexpr std::int64_t kDrawEvery_us = 1'000'000;

double largest_sigma_m(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(
      Eigen::Matrix2d(covariance.topLeftCorner<2, 2>()), Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues()(1)));
}

bool has_place(const model::SlamPose& pose) { return pose.is_localised() || pose.is_coasting; }

/// How long no pose may come, by how many come usually.
std::int64_t silent_after_us(std::optional<double> rate_hz) {
  if (!rate_hz) return kSilentPose_us;
  const double usual_us = kSilentIntervals * 1e6 / *rate_hz;
  return std::clamp(static_cast<std::int64_t>(std::min(usual_us, 1e12)), kSilentPose_us,
                    kLatestSilence_us);
}

/// Of the numbers of slam_pose2_t: whether a path is drawn the same at both.
bool is_same_line(std::uint8_t a, std::uint8_t b) { return (a == 6) == (b == 6); }

}  // namespace

const char* state_name(Verdict::State state) {
  switch (state) {
    case Verdict::State::kWaiting:
      return "waiting";
    case Verdict::State::kOk:
      return "ok";
    case Verdict::State::kUnsure:
      return "unsure";
    case Verdict::State::kLost:
      return "lost";
    case Verdict::State::kSilent:
      return "silent";
  }
  return "waiting";
}

Scene::Scene() { changed(verdict_) = {}; }

void Scene::note_time(model::Utime utime, std::int64_t wall_us) {
  utime_ = std::max(utime_, utime);
  newest_wall_us_ = std::max(newest_wall_us_, wall_us);
}

void Scene::reset() {
  start_map(0);
  wants_map_ = true;
  changed(pose_).reset();
  changed(scan_) = {};
  changed(numbers_) = {};
  closures_.clear();
  closures_change_ = ++change_;
  processes_.clear();
  log_.clear();
  world_truth_.clear();
  utime_ = -1;
  newest_wall_us_ = pose_wall_us_ = 0;
  pose_times_us_.clear();
  least_age_us_ = {};
  age_period_us_ = 0;
  set_verdict(Verdict::State::kWaiting, "no pose yet", 0);
}

/// Another map has another frame: nothing of the one before means anything in it.
void Scene::start_map(std::uint32_t map_id) {
  map_id_ = map_id;
  map_version_ = 0;
  landmarks_.clear();
  driven_.clear();
  keyframes_.clear();
  truth_.clear();
  submaps_.clear();
  handed_over_keyframes_.clear();
  submaps_change_ = ++change_;
  closures_.clear();
  closures_change_ = ++change_;
  changed(matches_) = {};
  changed(true_pose_).reset();
  alignment_.clear();
  world_T_map_.reset();
  SceneNumbers& numbers = changed(numbers_);
  numbers.error_m = numbers.error_rad = numbers.nees = std::nullopt;
  numbers.is_too_sure = false;
  reset_change_ = ++change_;
}

void Scene::take(const model::SlamPose& pose, std::int64_t wall_us) {
  note_time(pose.utime, wall_us);
  if (has_place(pose) && pose.map_id != map_id_) {
    if (map_id_ != 0) start_map(pose.map_id);
    map_id_ = pose.map_id;
  }
  changed(pose_) = pose;
  pose_wall_us_ = wall_us;

  if (has_place(pose)) {
    draw(pose);
    compare_with_truth(pose);
  }
  judge(pose);

  // How often poses come, and how late.
  SceneNumbers& numbers = changed(numbers_);
  if (!pose_times_us_.empty() && wall_us - pose_times_us_.back() > kLatestSilence_us)
    pose_times_us_.clear();  // A gap says nothing of how often poses come.
  pose_times_us_.push_back(wall_us);
  while (pose_times_us_.size() > 2 && wall_us - pose_times_us_.front() > 3'000'000)
    pose_times_us_.pop_front();
  const double span_s = 1e-6 * static_cast<double>(wall_us - pose_times_us_.front());
  if (span_s > 0.0) numbers.rate_hz = static_cast<double>(pose_times_us_.size() - 1) / span_s;
  std::optional<std::int64_t> least;
  for (const auto& age : least_age_us_) {
    if (age && (!least || *age < *least)) least = age;
  }
  if (least) numbers.latency_ms = 1e-3 * static_cast<double>(wall_us - pose.utime - *least);
}

/// The newest pose is always the last point; of those behind it as many as the eye can tell apart.
void Scene::draw(const model::SlamPose& pose) {
  const geometry::SE2 map_T_vehicle = pose.map_T_vehicle();
  const int status = pose.is_coasting ? 6 : pose.status ? static_cast<int>(*pose.status) : 5;
  const TrackPoint point{pose.utime,
                         static_cast<float>(map_T_vehicle.x()),
                         static_cast<float>(map_T_vehicle.y()),
                         static_cast<float>(map_T_vehicle.theta()),
                         static_cast<float>(largest_sigma_m(pose.covariance)),
                         static_cast<std::uint8_t>(status)};

  const auto points = driven_.points();
  if (points.size() > 1) {
    const TrackPoint& before = points[points.size() - 2];
    const bool is_near =
        std::hypot(before.x_m - point.x_m, before.y_m - point.y_m) < kDrawEvery_m &&
        std::abs(geometry::wrap_angle(before.theta_rad - point.theta_rad)) < kDrawEvery_rad &&
        point.utime - before.utime < kDrawEvery_us;
    if (is_near && is_same_line(points.back().status, point.status) &&
        is_same_line(before.status, point.status)) {
      driven_.replace_last(point);
      return;
    }
  }
  driven_.append(point);
}

void Scene::take_stamp(model::Utime utime, std::int64_t wall_us) {
  note_time(utime, wall_us);
  if (wall_us - age_period_us_ > kAgePeriod_us) {
    least_age_us_ = {std::nullopt, least_age_us_[0]};
    age_period_us_ = wall_us;
  }
  const std::int64_t age = wall_us - utime;
  if (!least_age_us_[0] || age < *least_age_us_[0]) least_age_us_[0] = age;
}

void Scene::set_verdict(Verdict::State state, std::string text, model::Utime utime) {
  if (verdict_.value.state == state && verdict_.value.text == text) return;
  Verdict& verdict = changed(verdict_);
  if (verdict.state != state) verdict.since_utime = utime;
  verdict.state = state;
  verdict.text = std::move(text);
}

void Scene::judge(const model::SlamPose& pose) {
  const double sigma_m = largest_sigma_m(pose.covariance);
  using State = Verdict::State;

  if (pose.is_lost) {
    set_verdict(State::kLost, "lost: no pose is certain, and odometry does not reach here",
                pose.utime);
  } else if (!has_place(pose)) {
    set_verdict(State::kUnsure, "no certain pose for this keyframe", pose.utime);
  } else if (pose.is_coasting) {
    set_verdict(State::kUnsure,
                fmt::format("coasting by odometry alone, \u00b1{:.2f} m", kSigmas * sigma_m),
                pose.utime);
  } else if (pose.is_provisional) {
    set_verdict(State::kUnsure, "few keyframes agree with the map yet", pose.utime);
  } else if (sigma_m > kUnsure_m) {
    set_verdict(State::kUnsure,
                fmt::format("localised, but only to \u00b1{:.1f} m", kSigmas * sigma_m),
                pose.utime);
  } else if (numbers_.value.is_too_sure && numbers_.value.nees) {
    set_verdict(
        State::kUnsure,
        fmt::format("\u00b1{:.2f} m is too small: NEES {:.0f} against ground truth, bound {:.1f}",
                    kSigmas * sigma_m, *numbers_.value.nees, kNeesBound),
        pose.utime);
  } else {
    set_verdict(State::kOk, fmt::format("localised, \u00b1{:.2f} m", kSigmas * sigma_m),
                pose.utime);
  }
}

void Scene::look(std::int64_t wall_us) {
  processes_.look(wall_us);
  if (pose_wall_us_ == 0 || wall_us - pose_wall_us_ <= silent_after_us(numbers_.value.rate_hz))
    return;
  set_verdict(Verdict::State::kSilent, "no pose comes any more", utime_);
  if (numbers_.value.rate_hz) changed(numbers_).rate_hz.reset();
}

void Scene::take(const model::MapUpdate& update) {
  utime_ = std::max(utime_, update.utime);
  const bool starts = update.status == model::MapUpdateStatus::kFirstMap;
  if (starts && map_id_ != 0) start_map(update.map_id);
  if (starts || map_id_ == 0) map_id_ = update.map_id;
  if (starts) tie_to_truth(update);
  changed(matches_).update = update;

  if (starts || update.status == model::MapUpdateStatus::kUpdated) {
    const model::KeyframePose keyframe{update.keyframe_sequence, update.utime, update.map_T_vehicle,
                                       update.covariance};
    keyframes_.take({&keyframe, 1});
  }
  if (update.degrees_of_freedom > 0) {
    SceneNumbers& numbers = changed(numbers_);
    numbers.nis = update.chi2;
    numbers.nis_dof = update.degrees_of_freedom;
  }
}

void Scene::take(const model::LandmarkScan& scan, std::int64_t wall_us) {
  note_time(scan.utime, wall_us);
  SceneScan& now = changed(scan_);
  now.utime = scan.utime;
  now.detections = scan.detections;
}

void Scene::take(const model::PlanarScan& scan, const geometry::SE2& vehicle_T_sensor) {
  SceneScan& now = changed(scan_);
  now.utime = scan.utime;
  now.points_m.clear();
  for (std::size_t beam = 0; beam < scan.ranges_m.size(); ++beam) {
    if (!scan.is_return(beam)) continue;
    const double range_m = scan.ranges_m[beam];
    const Eigen::Vector2d point =
        vehicle_T_sensor * Eigen::Vector2d(range_m * std::cos(scan.bearing(beam)),
                                           range_m * std::sin(scan.bearing(beam)));
    now.points_m.push_back({static_cast<float>(point.x()), static_cast<float>(point.y()), 0.0F});
  }
}

void Scene::take(const model::PointSweep& part) {
  SceneScan& now = changed(scan_);
  if (part.revolution != revolution_) now.points_m.clear();
  revolution_ = part.revolution;
  now.utime = part.utime;
  // Of many points every n-th: a page shows the shape.
  const std::size_t step =
      1 + part.points.size() * std::max<std::size_t>(1, part.parts) / kMostScanPoints;
  for (std::size_t i = 0; i < part.points.size(); i += step)
    now.points_m.push_back({part.points[i].x_m, part.points[i].y_m, part.points[i].z_m});
}

void Scene::take(const log_t& line) {
  if (log_.size() >= kMostLogLines) log_.pop_front();
  log_.push_back({line, ++change_});
}

}  // namespace understory::viewer
