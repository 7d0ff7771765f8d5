#include "eval/experiments/frontend/landmark_extraction.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>

#include "eval/tools/thread_clock.hpp"
#include "sim/visible_landmarks.hpp"

namespace understory::eval::experiments::frontend {
namespace {

using sim::VisibleCorner;
using sim::VisibleTrunk;

/// A true landmark, 1.3 m above the ground.
struct Truth {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  std::optional<double> bisector_rad;
  std::uint32_t returns = 0;
  bool should = false;
  bool is_taken = false;
};

std::vector<Truth> true_trunks(const sim::World& world, const sim::SimulatedSweep& sweep,
                               const sim::VehicleState& state, const ExtractionOptions& options) {
  std::vector<Truth> result;
  for (const VisibleTrunk& trunk : sim::visible_trunks(world, sweep, state)) {
    const bool should =
        trunk.range_m <= options.recall_range_m && trunk.returns >= options.least_returns;
    result.push_back({trunk.centre_m, std::nullopt, trunk.returns, should, false});
  }
  return result;
}

std::vector<Truth> true_corners(const sim::World& world, const sim::SimulatedSweep& sweep,
                                const sim::VehicleState& state, const ExtractionOptions& options) {
  std::vector<Truth> result;
  for (const VisibleCorner& corner : sim::visible_corners(world, sweep, state)) {
    const std::uint32_t least = std::min(corner.returns_before, corner.returns_after);
    const bool should =
        corner.range_m <= options.recall_range_m && least >= options.least_side_returns;
    const Eigen::Vector3d breast = corner.position_m + Eigen::Vector3d(0.0, 0.0, 1.3);
    result.push_back({breast, corner.bisector_rad, least, should, false});
  }
  return result;
}

/// Sums of one kind until the means are taken.
struct Tally {
  KindScore score;
  double square_m2 = 0.0;
  double square_rad2 = 0.0;
  std::uint64_t near = 0;

  void match(const model::Detection& detection, const Truth& truth, double error_range_m) {
    const Eigen::Vector3d error = detection.position_m - truth.position_m;
    const Eigen::Matrix2d plan = detection.covariance_m2.topLeftCorner<2, 2>();
    score.nees_plan += error.head<2>().dot(plan.inverse() * error.head<2>());
    score.nees_space += error.dot(detection.covariance_m2.inverse() * error);

    if (truth.position_m.head<2>().norm() <= error_range_m) {
      square_m2 += error.head<2>().squaredNorm();
      const Eigen::Vector2d ray = truth.position_m.head<2>().normalized();
      score.bias_along_m += ray.dot(error.head<2>());
      score.bias_across_m += ray.x() * error.y() - ray.y() * error.x();
      ++near;
    }

    if (truth.bisector_rad) {
      const double turned =
          std::remainder(detection.bearing_rad - *truth.bisector_rad, 2.0 * std::numbers::pi);
      square_rad2 += turned * turned;
      score.nees_bearing +=
          turned * turned / (detection.bearing_sigma_rad * detection.bearing_sigma_rad);
    }
  }

  KindScore finish() {
    const double matched = std::max<double>(1.0, static_cast<double>(score.right));
    score.nees_plan /= matched;
    score.nees_space /= matched;
    score.nees_bearing /= matched;
    score.bearing_rms_rad = std::sqrt(square_rad2 / matched);
    const double counted = std::max<double>(1.0, static_cast<double>(near));
    score.rms_m = std::sqrt(square_m2 / counted);
    score.bias_along_m /= counted;
    score.bias_across_m /= counted;
    return score;
  }
};

/// Each detection takes the nearest true landmark that is free; nearest pairs of a sweep would
/// differ only where two trunks are within half a metre.
void score_kind(const model::LandmarkScan& scan, model::LandmarkKind kind,
                std::vector<Truth> truths, const ExtractionOptions& options, Tally& tally,
                std::vector<ExtractionMiss>& misses) {
  for (const model::Detection& detection : scan.detections) {
    if (detection.kind != kind) continue;
    ++tally.score.detections;
    Truth* nearest = nullptr;
    double least = options.match_m;
    for (Truth& truth : truths) {
      const double distance = (detection.position_m - truth.position_m).head<2>().norm();
      if (!truth.is_taken && distance < least) {
        least = distance;
        nearest = &truth;
      }
    }
    if (nearest == nullptr) {
      misses.push_back({scan.utime, true, detection, 0});
      continue;
    }
    nearest->is_taken = true;
    ++tally.score.right;
    tally.match(detection, *nearest, options.error_range_m);
  }
  for (const Truth& truth : truths) {
    if (!truth.should) continue;
    ++tally.score.should;
    if (truth.is_taken) {
      ++tally.score.found;
      continue;
    }
    model::Detection missed;
    missed.kind = kind;
    missed.position_m = truth.position_m;
    misses.push_back({scan.utime, false, missed, truth.returns});
  }
}

double part_of(std::vector<double> values, double part) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
}

}  // namespace

model::PointSweep ideal_input(const sim::SimulatedSweep& sweep, const sim::SensorDrive& drive,
                              const Eigen::Vector2d& attitude_error_rad,
                              double attitude_sigma_rad) {
  model::PointSweep result = sweep.raw;
  const float last = result.points.empty() ? 0.0F : result.points.back().time_s;
  result.utime += static_cast<model::Utime>(std::llround(1e6 * static_cast<double>(last)));
  result.is_deskewed = true;
  const sim::VehicleState end = drive.state_at(result.utime);
  const Eigen::Isometry3d end_T_world = end.world_T_vehicle().inverse();
  const Eigen::Isometry3d vehicle_T_sensor = drive.suite().lidar->vehicle_T_sensor;
  Eigen::Isometry3d end_T_sensor = vehicle_T_sensor;
  float time = -1.0F;
  for (model::SweepPoint& point : result.points) {
    if (point.time_s != time) {
      time = point.time_s;
      const model::Utime utime =
          sweep.raw.utime +
          static_cast<model::Utime>(std::llround(1e6 * static_cast<double>(time)));
      end_T_sensor = end_T_world * drive.state_at(utime).world_T_vehicle() * vehicle_T_sensor;
    }
    const Eigen::Vector3d p = end_T_sensor * point.position().cast<double>();
    point.x_m = static_cast<float>(p.x());
    point.y_m = static_cast<float>(p.y());
    point.z_m = static_cast<float>(p.z());
    point.time_s -= last;
  }
  result.sensor_position_m = vehicle_T_sensor.translation();
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  result.attitude = model::Attitude{
      Eigen::Quaterniond(AngleAxisd(end.pitch_rad + attitude_error_rad.y(), Vector3d::UnitY()) *
                         AngleAxisd(end.roll_rad + attitude_error_rad.x(), Vector3d::UnitX())),
      attitude_sigma_rad * attitude_sigma_rad * Eigen::Matrix2d::Identity()};
  return result;
}

ExtractionScore score_extraction(sim::SensorDrive& drive,
                                 const landmark_extractor::LandmarkExtractorParameters& parameters,
                                 const ExtractionOptions& options,
                                 const std::function<void(int)>& progress) {
  ExtractionScore score;
  landmark_extractor::LandmarkExtractor extractor(parameters);
  std::mt19937_64 random(options.seed);
  std::normal_distribution<double> tilt(0.0, options.attitude_sigma_rad);

  std::vector<double> times_ms;
  Tally trunks;
  Tally corners;

  for (int k = 0; k < options.sweeps; ++k) {
    const std::uint64_t turn =
        options.first_revolution + static_cast<std::uint64_t>(k) * options.stride;
    if (turn >= drive.sweep_count()) break;

    const sim::SimulatedSweep sweep = drive.sweep(turn);
    const double roll_error = tilt(random);
    const double pitch_error = tilt(random);
    const model::PointSweep input =
        ideal_input(sweep, drive, {roll_error, pitch_error}, options.attitude_sigma_rad);

    const double before = 1e3 * tools::thread_time_s();
    const model::LandmarkScan scan = extractor.extract(input);
    times_ms.push_back(1e3 * tools::thread_time_s() - before);

    const sim::VehicleState state = drive.state_at(scan.utime);
    score_kind(scan, model::LandmarkKind::kTrunk, true_trunks(drive.world(), sweep, state, options),
               options, trunks, score.misses);
    score_kind(scan, model::LandmarkKind::kCorner,
               true_corners(drive.world(), sweep, state, options), options, corners, score.misses);

    score.beams = input.rings;
    score.points += static_cast<double>(input.points.size());
    ++score.sweeps;
    if (progress) progress(k + 1);
  }

  score.points /= std::max<double>(1.0, static_cast<double>(score.sweeps));
  score.trunks = trunks.finish();
  score.corners = corners.finish();
  score.time_p50_ms = part_of(times_ms, 0.5);
  score.time_p99_ms = part_of(times_ms, 0.99);
  return score;
}

}  // namespace understory::eval::experiments::frontend
