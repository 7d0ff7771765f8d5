#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/wire/convert.hpp"
#include "common/wire/convert_shared.hpp"

namespace understory {
namespace {

constexpr double kFinestResolutionM = 0.001;
constexpr double kFinestTimeStepS = 1e-6;
constexpr double kLargestCount = 32767.0;
constexpr double kLongestTurnS = 10.0;

/// The finest of `finest` * 2^k with which `largest` fits into 16 bits: the same again when what
/// was rounded is sent on.
double step_for(double largest, double finest) {
  double step = finest;
  while (largest > step * kLargestCount) step *= 2.0;
  return step;
}

std::int16_t rounded(float value, double inverse_step) {
  return static_cast<std::int16_t>(std::lrint(static_cast<double>(value) * inverse_step));
}

Attitude attitude(const lidar_sweep_t& wire, Checks& checks) {
  Attitude result;
  const Eigen::Quaterniond q(wire.level_Q_vehicle[0], wire.level_Q_vehicle[1],
                             wire.level_Q_vehicle[2], wire.level_Q_vehicle[3]);
  checks.range("level_Q_vehicle: norm", q.norm(), 0.999, 1.001);
  result.covariance_rad2 =
      checks.covariance("attitude_covariance_rad2", wire.attitude_covariance_rad2);
  if (!checks.refusal()) result.level_Q_vehicle = q;
  return result;
}

void check_counts(const lidar_sweep_t& wire, Checks& checks) {
  checks.range("turn", static_cast<double>(wire.turn), 0.0, 9.3e18);
  checks.range("parts", wire.parts, 1, 65535);
  checks.range("part", wire.part, 0, wire.parts - 1);
  checks.range("rings", wire.rings, 1, 256);
  checks.range("max_range_m", wire.max_range_m, 0.0, kLongestRangeM);
  checks.range("resolution_m", wire.resolution_m, 1e-6, 1.0);
  checks.range("time_step_s", wire.time_step_s, 1e-9, kLongestTurnS / kLargestCount);
  for (const double coordinate : wire.sensor_position_m) {
    checks.range("sensor_position_m", coordinate, -100.0, 100.0);
  }
}

void copy_points(const lidar_sweep_t& wire, Checks& checks, std::vector<SweepPoint>& points) {
  points.resize(wire.x.size());
  const auto resolution = static_cast<float>(wire.resolution_m);
  const auto step = static_cast<float>(wire.time_step_s);
  bool rings_fit = true;
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i] = {static_cast<float>(wire.x[i]) * resolution,
                 static_cast<float>(wire.y[i]) * resolution,
                 static_cast<float>(wire.z[i]) * resolution,
                 static_cast<float>(wire.time[i]) * step,
                 wire.ring[i],
                 wire.intensity[i]};
    rings_fit = rings_fit && wire.ring[i] < wire.rings;
  }
  checks.consistent(rings_fit, "ring < rings");
}

}  // namespace

Result<PointSweep> from_wire(const lidar_sweep_t& wire) {
  Checks checks;
  check_counts(wire, checks);
  PointSweep sweep;
  sweep.utime = wire.utime;
  sweep.sequence = static_cast<std::uint64_t>(wire.seq);
  sweep.turn = static_cast<std::uint64_t>(wire.turn);
  sweep.part = static_cast<std::uint16_t>(wire.part);
  sweep.parts = static_cast<std::uint16_t>(wire.parts);
  sweep.has_times = wire.has_times != 0;
  sweep.is_deskewed = wire.is_deskewed != 0;
  sweep.rings = static_cast<std::uint16_t>(wire.rings);
  sweep.max_range_m = wire.max_range_m;
  sweep.sensor_position_m = Eigen::Map<const Eigen::Vector3d>(wire.sensor_position_m);
  if (wire.has_attitude != 0) sweep.attitude = attitude(wire, checks);
  copy_points(wire, checks, sweep.points);
  if (checks.refusal()) return *checks.refusal();
  return sweep;
}

lidar_sweep_t to_wire(const PointSweep& sweep) {
  lidar_sweep_t wire{};
  wire.utime = sweep.utime;
  wire.seq = static_cast<std::int64_t>(sweep.sequence);
  wire.turn = static_cast<std::int64_t>(sweep.turn);
  wire.part = sweep.part;
  wire.parts = sweep.parts;
  wire.has_times = sweep.has_times ? 1 : 0;
  wire.is_deskewed = sweep.is_deskewed ? 1 : 0;
  wire.rings = sweep.rings;
  wire.max_range_m = sweep.max_range_m;
  copy_vector(sweep.sensor_position_m, wire.sensor_position_m);
  const Attitude attitude = sweep.attitude.value_or(Attitude{});
  wire.has_attitude = sweep.attitude ? 1 : 0;
  const Eigen::Quaterniond& q = attitude.level_Q_vehicle;
  copy_vector(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()), wire.level_Q_vehicle);
  copy_matrix(attitude.covariance_rad2, wire.attitude_covariance_rad2);

  float farthest = 0.0F;
  float longest = 0.0F;
  for (const SweepPoint& p : sweep.points) {
    // A NaN must win, which std::max does not promise: the sum carries it.
    const float size = std::max({std::abs(p.x_m), std::abs(p.y_m), std::abs(p.z_m)}) +
                       0.0F * (p.x_m + p.y_m + p.z_m);
    if (!(size <= farthest)) farthest = size;
    if (!(std::abs(p.time_s) <= longest)) longest = std::abs(p.time_s);
    if (std::isnan(farthest) || std::isnan(longest)) break;
  }
  if (!std::isfinite(farthest) || !std::isfinite(longest)) {
    throw std::invalid_argument("to_wire(PointSweep): a point is not finite");
  }
  wire.resolution_m = step_for(farthest, kFinestResolutionM);
  wire.time_step_s = step_for(longest, kFinestTimeStepS);
  const double per_metre = 1.0 / wire.resolution_m;
  const double per_second = 1.0 / wire.time_step_s;
  const std::size_t count = sweep.points.size();
  wire.num_points = static_cast<std::int32_t>(count);
  for (auto* numbers : {&wire.x, &wire.y, &wire.z, &wire.time}) numbers->resize(count);
  for (auto* numbers : {&wire.ring, &wire.intensity}) numbers->resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const SweepPoint& p = sweep.points[i];
    wire.x[i] = rounded(p.x_m, per_metre);
    wire.y[i] = rounded(p.y_m, per_metre);
    wire.z[i] = rounded(p.z_m, per_metre);
    wire.time[i] = rounded(p.time_s, per_second);
    wire.ring[i] = static_cast<std::uint8_t>(p.ring);
    wire.intensity[i] = p.intensity;
  }
  return wire;
}

}  // namespace understory
