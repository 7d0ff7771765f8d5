#include "services/associator/associator.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/geometry/alignment.hpp"
#include "services/associator/consistent_set.hpp"

namespace understory::associator {
namespace {

/// Odometry's own uncertainty is never trusted below this [m^2, rad^2].
constexpr double kMotionFloor = 1e-8;
constexpr double kMaxPoseAge_s = 1.0;
/// By it sightings are compared.
constexpr model::Utime kOdometryKept_us = 2'000'000;
/// A stamp so far back starts the clock anew.
constexpr model::Utime kClockJump_us = 10'000'000;
/// Acceleration [m/s^2] that a constant velocity may have missed.
constexpr double kUnknownAcceleration = 3.0;

std::vector<Seen> usable(const model::LandmarkScan& scan) {
  std::vector<Seen> seen;
  seen.reserve(scan.detections.size());
  for (std::uint32_t i = 0; i < scan.detections.size(); ++i) {
    const model::Detection& d = scan.detections[i];
    if (!d.position_m.allFinite() || !d.covariance_m2.allFinite()) continue;
    const Eigen::Matrix2d covariance = d.covariance_m2.topLeftCorner<2, 2>();
    if (covariance.llt().info() != Eigen::Success) continue;
    const double radius = std::isfinite(d.radius_m) ? d.radius_m : 0.0;
    seen.push_back({i, d.position_m.head<2>(), covariance, radius, d.kind});
  }
  return seen;
}

std::vector<geometry::UncertainPoint> points_of(const std::vector<Track>& tracks,
                                                model::LandmarkKind kind) {
  std::vector<geometry::UncertainPoint> points;
  for (const Track& track : tracks) {
    if (track.kind != kind || track.steadiness == Steadiness::kMoves) continue;
    points.push_back({track.position_m, track.variance_m2(), track.observations < 4 ? 8.0 : 0.0});
  }
  return points;
}

std::vector<geometry::UncertainPoint> points_of(const std::vector<Seen>& seen,
                                                model::LandmarkKind kind) {
  std::vector<geometry::UncertainPoint> points;
  for (const Seen& one : seen) {
    if (one.kind == kind) points.push_back({one.position_m, one.variance_m2()});
  }
  return points;
}

/// Refines a pose by trunks, then by corners; the pairs of both are counted in `pairs`.
geometry::Registration register_kinds(const std::vector<Track>& tracks,
                                      const std::vector<Seen>& seen,
                                      const geometry::SE2WithCovariance& guess,
                                      const geometry::RegistrationParameters& parameters) {
  geometry::Registration result{guess.mean, guess.covariance, {}};
  for (const model::LandmarkKind kind :
       {model::LandmarkKind::kTrunk, model::LandmarkKind::kCorner}) {
    geometry::Registration part =
        register_points(points_of(tracks, kind), points_of(seen, kind),
                        {result.reference_T_observed, result.covariance}, parameters);
    result.reference_T_observed = part.reference_T_observed;
    result.covariance = part.covariance;
    result.pairs.insert(result.pairs.end(), part.pairs.begin(), part.pairs.end());
  }
  return result;
}

}  // namespace

Associator::Associator(const AssociatorParameters& parameters)
    : parameters_(parameters), tracks_(parameters) {
  for (const char* name : {"auto", "nearest", "registered", "consistent"}) {
    if (parameters.method == name) return;
  }
  throw std::invalid_argument("method: no method is named " + parameters.method);
}

void Associator::add(const model::Odometry& increment) {
  if (!increment.from_T_to.coordinates().allFinite() || !increment.covariance.allFinite()) return;
  const model::Utime newest =
      odometry_.increments().empty() ? increment.from_utime : odometry_.increments().back().utime;
  if (increment.utime < newest - kClockJump_us) odometry_ = model::OdometryBuffer();
  odometry_.add(increment);
}

void Associator::add(const model::EkfPose& pose) {
  if (pose.velocity_mps.allFinite() && pose.bias.allFinite()) filter_pose_ = pose;
}

/// Where no wheels measure the way, the filter's velocity and the IMU since its pose tell it best.
std::optional<geometry::SE2WithCovariance> Associator::motion_by_filter(model::Utime utime) const {
  if (!filter_pose_ || !last_scan_ || filter_pose_->utime != *last_scan_) return std::nullopt;
  const double duration = 1e-6 * static_cast<double>(utime - *last_scan_);
  if (duration > kMaxPoseAge_s) return std::nullopt;
  const model::EkfPose& start = *filter_pose_;
  double yaw = 0.0;
  Eigen::Vector2d velocity = start.velocity_mps;
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
  model::Utime reached = *last_scan_;
  for (const model::Odometry& increment : odometry_.increments()) {
    if (increment.utime <= reached) continue;
    if (!increment.inertial || increment.from_utime > reached + 1000 ||
        increment.utime > utime + 1000)
      break;
    const model::Preintegration& p = *increment.inertial;
    const Eigen::Matrix<double, 5, 1> shift = p.bias_jacobian * (start.bias - p.bias);
    const Eigen::Matrix2d rotation = geometry::SE2(0.0, 0.0, yaw).rotation();
    position += velocity * p.seconds + rotation * (p.position_m + shift.tail<2>());
    velocity += rotation * (p.velocity_mps + shift.segment<2>(1));
    yaw += p.yaw_rad + shift(0);
    reached = increment.utime;
  }
  const double blind = 1e-6 * static_cast<double>(utime - reached);
  position += velocity * blind;
  const double shift_variance = std::pow(0.5 * kUnknownAcceleration * blind * blind, 2) +
                                kMotionFloor +
                                start.velocity_covariance.trace() * duration * duration;
  const double rotation_variance = std::pow(parameters_.motion_sigma_rad * blind / 0.1, 2) + 1e-6;
  return geometry::SE2WithCovariance{
      geometry::SE2(position, yaw),
      Eigen::Vector3d(shift_variance, shift_variance, rotation_variance).asDiagonal()};
}

std::optional<geometry::SE2WithCovariance> Associator::motion_to(model::Utime utime) const {
  auto motion = odometry_.between(*last_scan_, utime);
  const bool has_wheels = motion && odometry_.increments().back().has_wheels;
  if (has_wheels) return motion;
  if (auto filtered = motion_by_filter(utime)) {
    // The filter may be wrong: whoever is surer of the way leads.
    if (!motion || filtered->covariance.trace() < motion->covariance.trace()) return filtered;
  }
  return motion;
}

std::optional<geometry::SE2WithCovariance> Associator::motion_by_wheels(model::Utime from,
                                                                        model::Utime to) const {
  if (odometry_.increments().empty()) return std::nullopt;
  // The heading by steering alone is too poor.
  const model::Odometry& latest = odometry_.increments().back();
  if (!latest.has_wheels || !latest.inertial) return std::nullopt;
  return odometry_.between(from, to);
}

bool Associator::fits(const geometry::Registration& registration, std::size_t seen,
                      const model::FieldOfView& view) const {
  const geometry::SE2 vehicle_T_local = registration.reference_T_observed.inverse();
  std::size_t visible = 0, known = 0;
  for (const Track& track : tracks_.tracks()) {
    if (track.steadiness == Steadiness::kMoves) continue;
    if (!view.contains(vehicle_T_local * track.position_m)) continue;
    ++known;
    if (track.observations >= 2) ++visible;
  }
  const double possible = static_cast<double>(std::min(seen, visible > 0 ? visible : known));
  return static_cast<double>(registration.pairs.size()) >=
             parameters_.min_matched_ratio * possible &&
         registration.pairs.size() >=
             std::min<std::size_t>(static_cast<std::size_t>(parameters_.min_matched),
                                   std::min(seen, known));
}

geometry::Registration Associator::locate(const std::vector<Seen>& seen,
                                          const model::FieldOfView& view, model::Utime utime) {
  geometry::RegistrationParameters registration;
  registration.gate_sigmas = parameters_.gate_sigmas;
  const double interval = 1e-6 * static_cast<double>(utime - *last_scan_);
  auto motion = motion_to(utime);
  const double stretch = std::max(1.0, interval / last_interval_s_);
  if (!motion) {
    ++counters_.scans_without_motion;
    const Eigen::Vector3d sigma(parameters_.motion_sigma_m, parameters_.motion_sigma_m,
                                parameters_.motion_sigma_rad);
    motion = {geometry::SE2::Exp(interval / last_interval_s_ * last_motion_.Log()),
              (stretch * sigma).cwiseAbs2().asDiagonal()};
  }
  motion->covariance += kMotionFloor * Eigen::Matrix3d::Identity();
  const geometry::SE2WithCovariance guess{local_T_vehicle_ * motion->mean, motion->covariance};
  if (parameters_.method == "nearest") return {guess.mean, guess.covariance, {}};
  geometry::Registration found = register_kinds(tracks_.tracks(), seen, guess, registration);
  const bool good = fits(found, seen.size(), view);
  if (parameters_.method == "registered" || (parameters_.method == "auto" && good)) return found;
  geometry::Registration searched = search(seen, guess, registration);
  return searched.pairs.size() > found.pairs.size() || !good ? searched : found;
}

/// The pose by the largest consistent set, refined.
geometry::Registration Associator::search(const std::vector<Seen>& seen,
                                          const geometry::SE2WithCovariance& guess,
                                          const geometry::RegistrationParameters& registration) {
  ++counters_.searches;
  std::vector<ConsistencyPoint> reference, observed;
  for (const Track& track : tracks_.tracks()) {
    reference.push_back({track.position_m, track.variance_m2(), static_cast<int>(track.kind)});
  }
  for (const Seen& one : seen) {
    observed.push_back({one.position_m, one.variance_m2(), static_cast<int>(one.kind)});
  }
  ConsistencyGate gate;
  const double sigma = std::sqrt(guess.covariance.topLeftCorner<2, 2>().trace());
  gate.sigmas = parameters_.gate_sigmas;
  gate.shift_m = std::max(parameters_.motion_sigma_m, sigma) * parameters_.gate_sigmas;
  gate.rotation_rad = parameters_.max_rotation_rad;
  const auto pairs = consistent_set(reference, observed, guess.mean, gate);
  if (pairs.size() < 3) return {guess.mean, guess.covariance, {}};
  geometry::RigidAlignment2 alignment;
  double variance = 0.0;
  for (const auto& pair : pairs) {
    const auto& a = reference[pair.reference];
    const auto& b = observed[pair.observed];
    alignment.add(a.position_m, b.position_m, 1.0 / (a.variance_m2 + b.variance_m2));
    variance = std::max(variance, a.variance_m2 + b.variance_m2);
  }
  // Roughly what three points tell; the refinement finds the true uncertainty.
  const Eigen::Matrix3d covariance = Eigen::Vector3d(variance, variance, 0.01).asDiagonal();
  return register_kinds(tracks_.tracks(), seen, {alignment.a_T_b(), covariance}, registration);
}

std::optional<model::TrackedScan> Associator::add(const model::LandmarkScan& scan) {
  ++counters_.scans;
  counters_.detections += scan.detections.size();
  if (last_scan_ && scan.utime < *last_scan_ - kClockJump_us) {
    counters_.last_reason = "the clock jumped back";
    tracks_.clear();
    last_scan_.reset();
  } else if (last_scan_ && scan.utime <= *last_scan_) {
    ++counters_.scans_refused;
    counters_.last_reason = "scan is late or came twice";
    return std::nullopt;
  }
  const std::vector<Seen> seen = usable(scan);
  counters_.detections_unusable += scan.detections.size() - seen.size();
  geometry::Registration pose;
  if (last_scan_) {
    pose = locate(seen, scan.field_of_view, scan.utime);
    if (parameters_.method != "nearest" && !seen.empty() &&
        !fits(pose, seen.size(), scan.field_of_view)) {
      counters_.last_reason = "a scan fitted no track";
      // Passing traffic, a gust of false detections: the next scan is more likely to fit than all
      // landmarks are to have gone.
      if (!tracks_.tracks().empty() && ++misfits_ <= parameters_.max_misfits) {
        ++counters_.scans_passed_over;
        return model::TrackedScan{scan.utime, next_sequence_++, scan.field_of_view, {}};
      }
      ++counters_.scans_lost;
      tracks_.clear();
    }
  }
  misfits_ = 0;
  const auto matches =
      match(tracks_.tracks(), seen, {pose.reference_T_observed, pose.covariance}, parameters_);
  return publish(scan, seen, matches, pose.reference_T_observed);
}

model::TrackedScan Associator::publish(const model::LandmarkScan& scan,
                                       const std::vector<Seen>& seen,
                                       const std::vector<Match>& matches,
                                       const geometry::SE2& local_T_vehicle) {
  if (last_scan_) {
    last_motion_ = local_T_vehicle_.inverse() * local_T_vehicle;
    last_interval_s_ = 1e-6 * static_cast<double>(scan.utime - *last_scan_);
  }
  local_T_vehicle_ = local_T_vehicle;
  last_scan_ = scan.utime;
  odometry_.forget_before(scan.utime - kOdometryKept_us);
  const model::TrackId before = tracks_.next_id();
  if (parameters_.walking_mps > 0.0) {
    tracks_.check_steadiness(seen, matches, scan.utime,
                             [&](model::Utime from) { return motion_by_wheels(from, scan.utime); });
  }
  const auto ids = tracks_.update(seen, matches, local_T_vehicle, scan.field_of_view, scan.utime);
  counters_.tracks_confirmed += tracks_.next_id() - before;
  for (const Match& match : matches) counters_.ambiguous += match.ambiguous ? 1 : 0;
  model::TrackedScan out{scan.utime, next_sequence_++, scan.field_of_view, {}};
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (ids[i] == 0) continue;
    out.landmarks.push_back({ids[i], seen[i].detection, scan.detections[seen[i].detection]});
  }
  counters_.published += out.landmarks.size();
  return out;
}

}  // namespace understory::associator
