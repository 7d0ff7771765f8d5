#include "sim/drive.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <utility>

#include "sim/few_landmarks.hpp"
#include "sim/random_streams.hpp"

namespace understory::sim {
namespace {

constexpr double kGridTile_m = 10.0;

Forest forest_that_holds(const DriveParameters& parameters, std::uint64_t seed) {
  ForestParameters forest = parameters.forest;
  if (parameters.clear_the_path) {
    double reach = 0.0;
    for (const geometry::SE2& pose : make_path(parameters.path)) {
      reach = std::max(reach, pose.translation().norm());
    }
    // Worst case: the start is at the edge of the central half and the path goes straight outward.
    forest.side_m = std::max(forest.side_m, 4.0 * (reach + parameters.start.margin_m));
  }
  std::mt19937_64 random = random_stream(seed, Stream::kForest);
  return make_forest(forest, random);
}

bool inside(const Forest& forest, const Eigen::Vector2d& p, double margin_m) {
  return ((p - forest.low_m).array() >= margin_m).all() &&
         ((forest.high_m - p).array() >= margin_m).all();
}

/// The path, so dense that a disc around each point covers the distance to the next.
bool fits(const Forest& forest, const PointGrid& grid, const std::vector<geometry::SE2>& path,
          const geometry::SE2& start, const StartPoseParameters& parameters) {
  for (const geometry::SE2& pose : path) {
    const Eigen::Vector2d p = start * pose.translation();
    if (!inside(forest, p, parameters.margin_m)) return false;
    if (grid.any_within(p, parameters.clearance_m)) return false;
  }
  return true;
}

geometry::SE2 draw_in_central_half(const Forest& forest, std::mt19937_64& random) {
  const Eigen::Vector2d size = forest.high_m - forest.low_m;
  std::uniform_real_distribution<double> along(0.25, 0.75);
  std::uniform_real_distribution<double> heading(-std::numbers::pi, std::numbers::pi);
  const double x = forest.low_m.x() + along(random) * size.x();
  const double y = forest.low_m.y() + along(random) * size.y();
  return {x, y, heading(random)};
}

model::FieldOfView field_of_view(const SensorParameters& sensor) {
  return {sensor.range_m, 0.0, sensor.view_rad};
}

bool is_in_sector(const Eigen::Vector2d& position_m, const SensorParameters& sensor) {
  return std::abs(std::atan2(position_m.y(), position_m.x())) <= 0.5 * sensor.view_rad;
}

/// Largest displacement of a trunk by shared errors: 6 sigma.
double shared_reach_m(const SensorParameters& sensor, const SharedErrorParameters& p) {
  const double sigma_m = std::hypot(p.along_sigma_m, p.direction_sigma_m,
                                    std::abs(p.level_height_m) * p.level_sigma_rad);
  return 6.0 * sigma_m + std::abs(p.radial_bias_share) * sensor.range_m;
}

}  // namespace

SimulatedScan observe(const Forest& forest, const PointGrid& grid,
                      const geometry::SE2& world_T_vehicle, const SensorParameters& sensor,
                      std::mt19937_64& random, const SharedErrorsAt& shared) {
  SimulatedScan result;
  result.world_T_vehicle = world_T_vehicle;
  result.scan.field_of_view = field_of_view(sensor);
  const double variance =
      std::max(sensor.variance_floor_m2, sensor.stated_factor * sensor.stated_factor *
                                             sensor.position_sigma_m * sensor.position_sigma_m);
  model::Detection detection;
  detection.covariance_m2.topLeftCorner<2, 2>() = variance * Eigen::Matrix2d::Identity();
  std::uniform_real_distribution<double> chance(0.0, 1.0);

  std::normal_distribution<double> noise(0.0, 1.0);
  const geometry::SE2 vehicle_T_world = world_T_vehicle.inverse();

  const double reach =
      sensor.reach_m() +
      (shared.errors != nullptr ? shared_reach_m(sensor, shared.errors->parameters()) : 0.0);
  std::vector<std::pair<model::Detection, std::uint32_t>> seen;
  for (const std::uint32_t trunk : grid.within(world_T_vehicle.translation(), reach)) {
    const bool detected = chance(random) < sensor.detection_probability;
    const double dx = noise(random);
    const Eigen::Vector2d exact = vehicle_T_world * forest.trunks_m[trunk];
    Eigen::Vector2d position = exact + sensor.position_sigma_m * Eigen::Vector2d(dx, noise(random));
    if (!detected) continue;
    if (shared.errors != nullptr) {
      if (shared.errors->is_missed(trunk)) continue;
      position += shared.errors->error_m(trunk, exact, world_T_vehicle, shared.along_m);
    }
    if (position.norm() > sensor.range_m || !is_in_sector(position, sensor)) continue;
    detection.position_m.head<2>() = position;
    detection.radius_m = forest.radii_m[trunk];
    seen.emplace_back(detection, trunk);
  }

  // The order of the trunks would identify them.
  std::shuffle(seen.begin(), seen.end(), random);
  for (const auto& [seen_detection, trunk] : seen) {
    result.scan.detections.push_back(seen_detection);
    result.trunks.push_back(trunk);
  }

  return result;
}

std::optional<geometry::SE2> draw_start_pose(const Forest& forest, const PointGrid& grid,
                                             const std::vector<geometry::SE2>& path,
                                             const StartPoseParameters& parameters,
                                             std::mt19937_64& random) {
  for (int i = 0; i < parameters.tries; ++i) {
    const geometry::SE2 start = draw_in_central_half(forest, random);
    if (fits(forest, grid, path, start, parameters)) return start;
  }
  return std::nullopt;
}

Drive::Drive(const DriveParameters& parameters, std::uint64_t seed)
    : Drive(parameters, forest_that_holds(parameters, seed), seed) {}

Drive::Drive(const DriveParameters& parameters, Forest forest, std::uint64_t seed)
    : parameters_(parameters),
      seed_(seed),
      shared_(parameters.sensor.shared, seed, seed),
      forest_(std::move(forest)) {
  grid_ = std::make_unique<PointGrid>(forest_.trunks_m, kGridTile_m);
  place_path();
  if (parameters_.trunks_in_view > 0.0) {
    forest_ = thinned_to(parameters_.trunks_in_view, forest_, world_T_vehicle_,
                         field_of_view(parameters_.sensor), seed_);
    grid_ = std::make_unique<PointGrid>(forest_.trunks_m, kGridTile_m);
  }
  measure_path();
}

void Drive::place_path() {
  world_T_vehicle_ = make_path(parameters_.path);
  StartPoseParameters start = parameters_.start;
  // Between two observations the robot is up to half an interval from the nearer one.
  start.clearance_m = std::hypot(start.clearance_m, 0.5 * parameters_.path.interval);
  if (parameters_.clear_the_path) start.clearance_m = 0.0;
  std::mt19937_64 random = random_stream(seed_, Stream::kStartPose);
  const auto world_T_start = draw_start_pose(forest_, *grid_, world_T_vehicle_, start, random);
  if (!world_T_start) {
    throw std::runtime_error("the path '" + std::string(to_string(parameters_.path.kind)) +
                             "' fits nowhere in this forest");
  }
  for (geometry::SE2& pose : world_T_vehicle_) pose = *world_T_start * pose;
  if (parameters_.clear_the_path) fell_trunks_on(world_T_vehicle_);
}

void Drive::fell_trunks_on(const std::vector<geometry::SE2>& path) {
  std::vector<bool> felled(forest_.trunks_m.size(), false);
  for (const geometry::SE2& pose : path) {
    for (const std::uint32_t trunk :
         grid_->within(pose.translation(), parameters_.start.clearance_m)) {
      felled[trunk] = true;
    }
  }

  Forest cleared{forest_.low_m, forest_.high_m, {}, {}};
  for (std::size_t i = 0; i < felled.size(); ++i) {
    if (felled[i]) continue;
    cleared.trunks_m.push_back(forest_.trunks_m[i]);
    cleared.radii_m.push_back(forest_.radii_m[i]);
  }

  forest_ = std::move(cleared);
  grid_ = std::make_unique<PointGrid>(forest_.trunks_m, kGridTile_m);
}

void Drive::measure_path() {
  along_m_.assign(world_T_vehicle_.size(), 0.0);
  for (std::size_t k = 1; k < along_m_.size(); ++k) {
    const double step_m =
        (world_T_vehicle_[k].translation() - world_T_vehicle_[k - 1].translation()).norm();
    along_m_[k] = along_m_[k - 1] + step_m;
  }
}

model::Utime Drive::utime(std::size_t k) const {
  return static_cast<model::Utime>(std::llround(static_cast<double>(k) * 1e6 *
                                                parameters_.path.interval / parameters_.speed_mps));
}

double Drive::reach_m() const {
  const SensorParameters& sensor = parameters_.sensor;
  return sensor.reach_m() + shared_reach_m(sensor, sensor.shared);
}

SimulatedScan Drive::scan(std::size_t k) const {
  std::mt19937_64 random = random_stream(seed_, Stream::kObservation, k);
  const SharedErrorsAt shared{parameters_.sensor.shared.any() ? &shared_ : nullptr, along_m_[k]};
  SimulatedScan result =
      observe(forest_, *grid_, world_T_vehicle_[k], parameters_.sensor, random, shared);
  result.scan.utime = utime(k);
  result.scan.sequence = k;
  return result;
}

model::Odometry Drive::odometry(std::size_t k) const {
  constexpr double kLeastSigma_m = 1e-4;
  constexpr double kLeastSigma_rad = 1e-5;
  const geometry::SE2 motion = world_T_vehicle_[k - 1].inverse() * world_T_vehicle_[k];
  const WheelOdometryParameters& wheels = parameters_.wheels;
  const double distance_m = motion.translation().norm();
  const double sigma_m = std::max(kLeastSigma_m, wheels.distance_share * distance_m);
  const double sigma_rad = std::hypot(kLeastSigma_rad, wheels.heading_walk * std::sqrt(distance_m),
                                      wheels.turn_share * motion.theta());

  std::mt19937_64 random = random_stream(seed_, Stream::kWheels, k);
  std::normal_distribution<double> normal(0.0, 1.0);
  const double x = normal(random), y = normal(random), turn = normal(random);
  model::Odometry odometry;
  odometry.from_utime = utime(k - 1);
  odometry.utime = utime(k);
  odometry.sequence = k - 1;
  odometry.from_T_to = motion * geometry::SE2::Exp({sigma_m * x, sigma_m * y, sigma_rad * turn});
  odometry.covariance =
      Eigen::Vector3d(sigma_m * sigma_m, sigma_m * sigma_m, sigma_rad * sigma_rad).asDiagonal();
  odometry.has_wheels = true;
  return odometry;
}

}  // namespace understory::sim
