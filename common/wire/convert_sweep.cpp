#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include "common/wire/convert.hpp"
#include "common/wire/convert_shared.hpp"

namespace understory::wire {
namespace {

constexpr double kFinestResolutionM = 0.001;
constexpr double kFinestTimeStepS = 1e-6;
constexpr double kLargestCount = 32767.0;
constexpr double kLongestTurnS = 10.0;

/// The finest of `finest` * 2^k with which `largest` fits into 16 bits: rounded values that are
/// sent on get the same step.
double step_for(double largest, double finest) {
  double step = finest;
  while (largest > step * kLargestCount) step *= 2.0;
  return step;
}

/// Rounds to nearest, halves to even, by adding a number whose last bit has the value 1: no call
/// per coordinate. Precondition: fits into 16 bits.
std::int16_t rounded(float value, double inverse_step) {
  constexpr double kOnes = 0x1.8p52;
  const double sum = static_cast<double>(value) * inverse_step + kOnes;
  return static_cast<std::int16_t>(std::bit_cast<std::int64_t>(sum));
}

/// Magnitudes of floats as integers in the same order; infinity is above all numbers, NaN above
/// infinity.
std::uint32_t size_bits(float value) { return std::bit_cast<std::uint32_t>(value) & 0x7fffffffU; }

/// Writes the points with steps that fit the largest coordinate. Throws where one is not finite.
void write_points(const std::vector<model::SweepPoint>& points, lidar_sweep_t& wire) {
  std::uint32_t farthest = 0;
  std::uint32_t longest = 0;
  for (const model::SweepPoint& p : points) {
    farthest = std::max({farthest, size_bits(p.x_m), size_bits(p.y_m), size_bits(p.z_m)});
    longest = std::max(longest, size_bits(p.time_s));
  }

  const auto farthest_m = std::bit_cast<float>(farthest);
  const auto longest_s = std::bit_cast<float>(longest);
  if (!std::isfinite(farthest_m) || !std::isfinite(longest_s)) {
    throw std::invalid_argument("to_wire(PointSweep): a point is not finite");
  }

  wire.resolution_m = step_for(farthest_m, kFinestResolutionM);
  wire.time_step_s = step_for(longest_s, kFinestTimeStepS);
  const double per_metre = 1.0 / wire.resolution_m;
  const double per_second = 1.0 / wire.time_step_s;
  const std::size_t count = points.size();
  wire.num_points = static_cast<std::int32_t>(count);
  for (auto* numbers : {&wire.x, &wire.y, &wire.z, &wire.time}) numbers->resize(count);

  for (auto* numbers : {&wire.ring, &wire.intensity}) numbers->resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const model::SweepPoint& p = points[i];
    wire.x[i] = rounded(p.x_m, per_metre);
    wire.y[i] = rounded(p.y_m, per_metre);
    wire.z[i] = rounded(p.z_m, per_metre);
    wire.time[i] = rounded(p.time_s, per_second);
    wire.ring[i] = static_cast<std::uint8_t>(p.ring);
    wire.intensity[i] = p.intensity;
  }
}

model::Attitude attitude(const lidar_sweep_t& wire, Checks& checks) {
  model::Attitude result;
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

void copy_points(const lidar_sweep_t& wire, Checks& checks,
                 std::vector<model::SweepPoint>& points) {
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

Result<model::PointSweep> from_wire(const lidar_sweep_t& wire) {
  Checks checks;
  check_counts(wire, checks);
  model::PointSweep sweep;
  take_stamp(wire, sweep);
  sweep.revolution = static_cast<std::uint64_t>(wire.turn);
  sweep.part = static_cast<std::uint16_t>(wire.part);
  sweep.parts = static_cast<std::uint16_t>(wire.parts);
  sweep.has_times = wire.has_times != 0;
  sweep.is_deskewed = wire.is_deskewed != 0;
  sweep.rings = static_cast<std::uint16_t>(wire.rings);
  sweep.max_range_m = wire.max_range_m;
  sweep.sensor_position_m = Eigen::Map<const Eigen::Vector3d>(wire.sensor_position_m);
  if (wire.has_attitude != 0) sweep.attitude = attitude(wire, checks);

  copy_points(wire, checks, sweep.points);
  return checks.result(sweep);
}

lidar_sweep_t to_wire(const model::PointSweep& sweep) {
  lidar_sweep_t wire{};
  put_stamp(sweep, wire);
  wire.turn = static_cast<std::int64_t>(sweep.revolution);
  wire.part = sweep.part;
  wire.parts = sweep.parts;
  wire.has_times = sweep.has_times ? 1 : 0;
  wire.is_deskewed = sweep.is_deskewed ? 1 : 0;
  wire.rings = sweep.rings;
  wire.max_range_m = sweep.max_range_m;
  copy_vector(sweep.sensor_position_m, wire.sensor_position_m);
  const model::Attitude attitude = sweep.attitude.value_or(model::Attitude{});
  wire.has_attitude = sweep.attitude ? 1 : 0;
  const Eigen::Quaterniond& q = attitude.level_Q_vehicle;

  copy_vector(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()), wire.level_Q_vehicle);
  copy_matrix(attitude.covariance_rad2, wire.attitude_covariance_rad2);
  write_points(sweep.points, wire);

  return wire;
}

}  // namespace understory::wire
