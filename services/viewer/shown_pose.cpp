#include "services/viewer/shown_pose.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

namespace understory::viewer {
namespace {

/// Poses at less than 3 Hz are silent after this number of their intervals, but at the latest after
/// kLatestSilence_us.
constexpr std::int64_t kSilentPose_us = 1'000'000;
constexpr double kSilentIntervals = 3.0;
constexpr std::int64_t kLatestSilence_us = 10'000'000;
constexpr double kSigmas = 3.0;    ///< Of the values shown to people.
constexpr double kUnsure_m = 1.0;  ///< A larger standard deviation counts as unsure.
constexpr float kDrawEvery_m = 1.0F;
constexpr double kDrawEvery_rad = 0.05;
constexpr std::int64_t kDrawEvery_us = 1'000'000;

double largest_sigma_m(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(
      Eigen::Matrix2d(covariance.topLeftCorner<2, 2>()), Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues()(1)));
}

/// Longest time without a pose, from the usual rate.
std::int64_t silent_after_us(std::optional<double> rate_hz) {
  if (!rate_hz) return kSilentPose_us;
  const double usual_us = kSilentIntervals * 1e6 / *rate_hz;
  return std::clamp(static_cast<std::int64_t>(std::min(usual_us, 1e12)), kSilentPose_us,
                    kLatestSilence_us);
}

/// From the numbers of slam_pose2_t: whether the path is drawn the same for both.
bool is_same_line(std::uint8_t a, std::uint8_t b) { return (a == 6) == (b == 6); }

}  // namespace

bool has_place(const model::SlamPose& pose) { return pose.is_localised() || pose.is_coasting; }

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

void ShownPose::clear() {
  pose_.changed(*changes_).reset();
  wall_us_ = 0;
  times_us_.clear();
  set_verdict(Verdict::State::kWaiting, "no pose yet", 0);
}

void ShownPose::take(const model::SlamPose& pose, std::int64_t wall_us) {
  pose_.changed(*changes_) = pose;
  wall_us_ = wall_us;
  if (has_place(pose)) draw(pose);

  if (!times_us_.empty() && wall_us - times_us_.back() > kLatestSilence_us)
    times_us_.clear();  // A gap is not used for the rate of poses.
  times_us_.push_back(wall_us);
  while (times_us_.size() > 2 && wall_us - times_us_.front() > 3'000'000) times_us_.pop_front();
}

std::optional<double> ShownPose::rate_hz() const {
  if (times_us_.size() < 2) return std::nullopt;
  const double span_s = 1e-6 * static_cast<double>(times_us_.back() - times_us_.front());
  if (span_s <= 0.0) return std::nullopt;
  return static_cast<double>(times_us_.size() - 1) / span_s;
}

/// The newest pose is always the last point; earlier ones are thinned to visible distances.
void ShownPose::draw(const model::SlamPose& pose) {
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

void ShownPose::set_verdict(Verdict::State state, std::string text, model::Utime utime) {
  if (verdict_.value.state == state && verdict_.value.text == text) return;
  Verdict& verdict = verdict_.changed(*changes_);
  if (verdict.state != state) verdict.since_utime = utime;
  verdict.state = state;
  verdict.text = std::move(text);
}

void ShownPose::judge(const SceneNumbers& numbers) {
  const model::SlamPose& pose = *pose_.value;
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
  } else if (numbers.is_too_sure && numbers.nees) {
    set_verdict(
        State::kUnsure,
        fmt::format("\u00b1{:.2f} m is too small: NEES {:.0f} against ground truth, bound {:.1f}",
                    kSigmas * sigma_m, *numbers.nees, kNeesBound),
        pose.utime);
  } else {
    set_verdict(State::kOk, fmt::format("localised, \u00b1{:.2f} m", kSigmas * sigma_m),
                pose.utime);
  }
}

bool ShownPose::falls_silent(std::int64_t wall_us, std::optional<double> rate_hz,
                             model::Utime utime) {
  if (wall_us_ == 0 || wall_us - wall_us_ <= silent_after_us(rate_hz)) return false;
  set_verdict(Verdict::State::kSilent, "no pose comes any more", utime);
  return true;
}

}  // namespace understory::viewer
