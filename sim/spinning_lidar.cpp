#include "sim/spinning_lidar.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/hash_random.hpp"
#include "sim/reflectivity.hpp"

namespace understory::sim {
namespace {

using std::numbers::pi;

std::vector<double> evenly(double first_deg, double step_deg, int count) {
  std::vector<double> result(static_cast<std::size_t>(count), first_deg);
  for (int i = 0; i < count; ++i) result[i] = (first_deg + i * step_deg) * pi / 180.0;
  return result;
}

std::vector<double> vlp32_elevations() {
  std::vector<double> result{-25.0,  -15.639, -11.31, -8.843, -7.254, -6.148, -5.333, -4.667,
                             -4.0,   -3.667,  -3.333, -3.0,   -2.667, -2.333, -2.0,   -1.667,
                             -1.333, -1.0,    -0.667, -0.333, 0.0,    0.333,  0.667,  1.0,
                             1.333,  1.667,   2.333,  3.333,  4.667,  7.0,    10.333, 15.0};
  for (double& elevation : result) elevation *= pi / 180.0;
  return result;
}

std::vector<double> hdl64_elevations() {
  std::vector<double> result = evenly(-24.33, 0.5, 32);
  const std::vector<double> upper = evenly(-8.33, 1.0 / 3.0, 32);
  result.insert(result.end(), upper.begin(), upper.end());
  return result;
}

/// Keys of independent random numbers of one ray.
enum Use : std::uint64_t { kFoliage = 1, kNoise = 2, kDropOut = 3, kWeak = 4, kWidth = 5 };

}  // namespace

std::vector<double> beam_elevations_rad(LidarModel model) {
  switch (model) {
    case LidarModel::kVlp16:
      return evenly(-15.0, 2.0, 16);
    case LidarModel::kVlp32:
      return vlp32_elevations();
    case LidarModel::kHdl32:
      return evenly(-30.67, 4.0 / 3.0, 32);
    case LidarModel::kHdl64:
      return hdl64_elevations();
  }
  return {};
}

SpinningLidar::SpinningLidar(const World& world, LidarParameters parameters, std::uint64_t seed)
    : world_(world),
      parameters_(std::move(parameters)),
      seed_(mixed(seed, 0x11da2)),
      caster_(world) {
  for (const double elevation : parameters_.elevations_rad) {
    beams_.emplace_back(std::cos(elevation), std::sin(elevation));
  }
  directions_.resize(beams_.size());
  hits_.resize(beams_.size());
}

bool SpinningLidar::is_lost(const RayHit& hit, double reflectivity, std::uint64_t luck) const {
  if (!hit.is_hit || hit.range_m < parameters_.min_range_m) return true;
  if (uniform_of(mixed(luck, kDropOut)) < parameters_.drop_out) return true;
  if (parameters_.white_range_m <= 0.0) return false;
  const double share = hit.range_m / parameters_.white_range_m;
  const double signal = reflectivity * hit.cosine / (share * share);
  const double weakness = 1.0 / (signal * signal);
  return uniform_of(mixed(luck, kWeak)) < weakness / (1.0 + weakness);
}

/// Random directions within the beams' width; `ahead` and `up` are axes of the sensor.
void SpinningLidar::point_beams(const Eigen::Vector3d& ahead, const Eigen::Vector3d& up,
                                std::uint64_t luck) {
  const Eigen::Vector3d aside = up.cross(ahead);
  const double width = 2.0 * parameters_.beam_half_width_rad;
  for (std::size_t i = 0; i < beams_.size(); ++i) {
    const std::uint64_t hash = mixed(luck + i);
    const double shift = width * (uniform_of(hash) - 0.5);
    const double lift = width * (uniform_of(hash << 32) - 0.5);
    const Eigen::Vector3d direction = (beams_[i].x() - lift * beams_[i].y()) * ahead +
                                      (beams_[i].y() + lift * beams_[i].x()) * up + shift * aside;
    directions_[i] = direction / std::sqrt(1.0 + shift * shift + lift * lift);
  }
}

void SpinningLidar::add_column(int column, double time_s, const Eigen::Isometry3d& world_T_vehicle,
                               std::uint64_t revolution, SimulatedSweep& sweep) {
  const double rotated = 2.0 * pi * column / parameters_.columns;
  const double bearing =
      parameters_.first_bearing_rad + (parameters_.clockwise ? -rotated : rotated);
  const Eigen::Vector2d ahead(std::cos(bearing), std::sin(bearing));
  const Eigen::Isometry3d world_T_sensor = world_T_vehicle * parameters_.vehicle_T_sensor;
  const Eigen::Vector3d level = world_T_sensor.linear().leftCols<2>() * ahead;
  const Eigen::Vector3d up = world_T_sensor.linear().col(2);
  const std::uint64_t column_luck =
      mixed(mixed(seed_, revolution), static_cast<std::uint64_t>(column)) & ~std::uint64_t{0xffff};

  point_beams(level, up, mixed(column_luck, kWidth));
  const Eigen::Vector3d origin = world_T_sensor.translation();
  caster_.cast(origin, directions_, time_s, parameters_.max_range_m, mixed(column_luck, kFoliage),
               hits_);

  for (std::size_t i = 0; i < beams_.size(); ++i) {
    const RayHit& hit = hits_[i];
    if (!hit.is_hit) continue;

    const std::uint64_t luck = mixed(column_luck + i);
    const Reflection reflection = reflection_of(world_, hit);
    RayHit effective = hit;
    effective.cosine = reflection.cosine;
    if (is_lost(effective, reflection.reflectivity, luck)) continue;

    const double range = hit.range_m + parameters_.range_sigma_m * normal_of(mixed(luck, kNoise));
    if (range < parameters_.min_range_m || range > parameters_.max_range_m) continue;

    model::SweepPoint point;
    point.x_m = static_cast<float>(range * beams_[i].x() * ahead.x());
    point.y_m = static_cast<float>(range * beams_[i].x() * ahead.y());
    point.z_m = static_cast<float>(range * beams_[i].y());
    point.time_s = static_cast<float>(column * parameters_.revolution_s() / parameters_.columns);
    point.ring = static_cast<std::uint16_t>(i);
    point.intensity = static_cast<std::uint8_t>(
        std::clamp(255.0 * reflection.reflectivity * (0.5 + 0.5 * reflection.cosine), 1.0, 255.0));

    sweep.raw.points.push_back(point);
    sweep.objects.push_back(hit.object);
    sweep.true_m.emplace_back((origin + hit.range_m * directions_[i]).cast<float>());
  }
}

SimulatedSweep SpinningLidar::sweep(const PoseAt& world_T_vehicle, std::uint64_t revolution,
                                    model::Utime utime_of_start) {
  SimulatedSweep result;
  model::PointSweep& raw = result.raw;
  raw.sequence = raw.revolution = revolution;
  raw.rings = static_cast<std::uint16_t>(beams_.size());
  raw.max_range_m = parameters_.max_range_m;
  const std::size_t most = beams_.size() * static_cast<std::size_t>(parameters_.columns);
  raw.points.reserve(most);

  result.objects.reserve(most);
  result.true_m.reserve(most);
  const double start_s = static_cast<double>(revolution) * parameters_.revolution_s();

  for (int column = 0; column < parameters_.columns; ++column) {
    const double time_s = start_s + column * parameters_.revolution_s() / parameters_.columns;
    add_column(column, time_s, world_T_vehicle(time_s), revolution, result);
  }

  // The stamp is that of the first point; the times count from it.
  const double first_s = raw.points.empty() ? 0.0 : raw.points.front().time_s;
  raw.utime = utime_of_start + static_cast<model::Utime>(std::floor((start_s + first_s) * 1e6));
  const double stamp_s = 1e-6 * static_cast<double>(raw.utime - utime_of_start) - start_s;

  for (model::SweepPoint& point : raw.points) {
    point.time_s = static_cast<float>(std::max(0.0, point.time_s - stamp_s));
  }

  return result;
}

SimulatedSweep SpinningLidar::sweep(const VehicleMotion& motion, std::uint64_t revolution,
                                    model::Utime utime_of_start) {
  return sweep([&](double time_s) { return motion.at(time_s).world_T_vehicle(); }, revolution,
               utime_of_start);
}

SimulatedSweep SpinningLidar::sweep_stationary(const Eigen::Isometry3d& world_T_vehicle,
                                               std::uint64_t revolution) {
  return sweep([&](double /*time_s*/) { return world_T_vehicle; }, revolution);
}

}  // namespace understory::sim
