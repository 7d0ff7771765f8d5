#include "eval/experiments/frontend/landmark_extraction.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "eval/tools/thread_clock.hpp"
#include "sim/visible_landmarks.hpp"

namespace understory::eval::experiments::frontend {
namespace {

using sim::VisibleCorner;
using sim::VisibleTrunk;

std::vector<TrueLandmark> true_trunks(const sim::World& world, const sim::SimulatedSweep& sweep,
                                      const sim::VehicleState& state,
                                      const ExtractionOptions& options) {
  std::vector<TrueLandmark> result;
  for (const VisibleTrunk& trunk : sim::visible_trunks(world, sweep, state)) {
    const bool should =
        trunk.range_m <= options.recall_range_m && trunk.returns >= options.least_returns;
    result.push_back({trunk.centre_m, std::nullopt, trunk.returns, should, false});
  }
  return result;
}

std::vector<TrueLandmark> true_corners(const sim::World& world, const sim::SimulatedSweep& sweep,
                                       const sim::VehicleState& state,
                                       const ExtractionOptions& options) {
  std::vector<TrueLandmark> result;
  for (const VisibleCorner& corner : sim::visible_corners(world, sweep, state)) {
    const std::uint32_t least = std::min(corner.returns_before, corner.returns_after);
    const bool should =
        corner.range_m <= options.recall_range_m && least >= options.least_side_returns;
    const Eigen::Vector3d breast = corner.position_m + Eigen::Vector3d(0.0, 0.0, 1.3);
    result.push_back({breast, corner.bisector_rad, least, should, false});
  }
  return result;
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
  KindTally trunks(options.match_m, options.error_range_m);
  KindTally corners(options.match_m, options.error_range_m);

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
    trunks.add(scan, model::LandmarkKind::kTrunk, true_trunks(drive.world(), sweep, state, options),
               score.misses);
    corners.add(scan, model::LandmarkKind::kCorner,
                true_corners(drive.world(), sweep, state, options), score.misses);

    score.beams = input.rings;
    score.points += static_cast<double>(input.points.size());
    ++score.sweeps;
    if (progress) progress(k + 1);
  }

  score.points /= std::max<double>(1.0, static_cast<double>(score.sweeps));
  score.trunks = trunks.score();
  score.corners = corners.score();
  score.time_p50_ms = part_of(times_ms, 0.5);
  score.time_p99_ms = part_of(times_ms, 0.99);
  return score;
}

}  // namespace understory::eval::experiments::frontend
