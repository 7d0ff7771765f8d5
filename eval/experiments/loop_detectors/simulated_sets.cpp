#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "eval/experiments/loop_detectors/frame_set.hpp"
#include "eval/tools/parallel.hpp"
#include "services/landmark_extractor/landmark_extractor.hpp"
#include "services/landmark_extractor/place/place_scans.hpp"
#include "sim/forest_world.hpp"
#include "sim/random_streams.hpp"
#include "sim/scenarios.hpp"
#include "sim/spinning_lidar.hpp"
#include "sim/stem_frames.hpp"

namespace understory::eval::experiments::loop_detectors {
namespace {

namespace places = understory::place_recognition;

constexpr double kFrameSpacingM = 3.0;
/// Of roll and pitch as an IMU gives them.
constexpr double kAttitudeSigmaRad = 0.003;

/// Where the vehicle is upright on the ground.
Eigen::Isometry3d upright(const sim::World& world, const geometry::SE2& pose) {
  Eigen::Isometry3d world_T_vehicle = Eigen::Isometry3d::Identity();
  world_T_vehicle.translation() << pose.translation(), world.ground().height(pose.translation());
  world_T_vehicle.linear() =
      Eigen::AngleAxisd(pose.theta(), Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return world_T_vehicle;
}

/// The sweep in frame `vehicle`, with an attitude that is off a little.
model::PointSweep in_vehicle(const model::PointSweep& raw,
                             const Eigen::Isometry3d& vehicle_T_sensor, std::mt19937_64& random) {
  model::PointSweep sweep = raw;
  for (model::SweepPoint& point : sweep.points) {
    const Eigen::Vector3f at = (vehicle_T_sensor * point.position().cast<double>()).cast<float>();
    point.x_m = at.x();
    point.y_m = at.y();
    point.z_m = at.z();
  }
  std::normal_distribution<double> tilt(0.0, kAttitudeSigmaRad);
  const double roll = tilt(random);
  const double pitch = tilt(random);
  sweep.is_deskewed = true;
  sweep.sensor_position_m = vehicle_T_sensor.translation();
  sweep.attitude =
      model::Attitude{Eigen::Quaterniond(Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                                         Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX())),
                      kAttitudeSigmaRad * kAttitudeSigmaRad * Eigen::Matrix2d::Identity()};
  return sweep;
}

places::PlaceFrame frame_of(const model::PointSweep& sweep,
                            landmark_extractor::LandmarkExtractor& extractor,
                            const landmark_extractor::PlaceScanParameters& cloud) {
  places::PlaceFrame frame;
  for (const model::Detection& found : extractor.extract(sweep).detections)
    frame.landmarks.push_back({found.position_m, 2.0 * found.radius_m});

  for (const model::PlacePoint& point :
       landmark_extractor::place::place_scan_of(sweep, cloud).points)
    frame.cloud.push_back(point.position_m());
  return frame;
}

/// A sweep every kFrameSpacingM of the way, each made on its own.
FrameSet swept(std::string name, const sim::World& world, const sim::Route& route,
               const SetOptions& options, const std::atomic<bool>& stop) {
  FrameSet set;
  set.name = std::move(name);
  set.has_clouds = true;
  const landmark_extractor::PlaceScanParameters cloud{.most_points = options.cloud_points};
  const auto count = static_cast<std::size_t>(route.length_m() / kFrameSpacingM) + 1;
  set.frames.resize(count);
  for (std::size_t k = 0; k < count; ++k)
    set.world_T_level.push_back(route.pose(static_cast<double>(k) * kFrameSpacingM));

  // A chunk of the way has one laser: its caster takes longer to make than a sweep.
  constexpr std::size_t kChunk = 50;
  const std::size_t chunks = (count + kChunk - 1) / kChunk;
  tools::run_in_parallel(chunks, options.jobs, set.name, stop, [&](std::size_t chunk) {
    sim::SpinningLidar lidar(world, sim::LidarParameters{}, options.seed);
    landmark_extractor::LandmarkExtractor extractor;
    for (std::size_t k = chunk * kChunk; k < std::min(count, (chunk + 1) * kChunk); ++k) {
      std::mt19937_64 random(options.seed * 1'000'003 + k);
      const sim::SimulatedSweep sweep =
          lidar.sweep_stationary(upright(world, set.world_T_level[k]), k);
      set.frames[k] = frame_of(in_vehicle(sweep.raw, lidar.parameters().vehicle_T_sensor, random),
                               extractor, cloud);
      set.frames[k].id = static_cast<places::FrameId>(k);
    }
  });
  return set;
}

}  // namespace

FrameSet forest_set(const SetOptions& options, const std::atomic<bool>& stop) {
  sim::ForestParameters parameters = sim::forest_parameters(sim::ForestKind::kIntermediate);
  // Small enough that the way meets itself.
  parameters.side_m = 260.0;
  std::mt19937_64 random(options.seed);
  const sim::Forest forest = sim::make_forest(parameters, random);
  const sim::Route way =
      sim::make_stem_way(sim::StemWay::kWander, forest, options.length_m, options.seed);
  const std::vector<Eigen::Vector2d> path = way.places(1.0);
  const sim::World world = sim::make_forest_world(forest, {}, path, random);
  return swept("forest", world, way, options, stop);
}

FrameSet town_set(const SetOptions& options, const std::atomic<bool>& stop) {
  const sim::Scenario scenario = sim::urban_scenario(2, options.seed);
  return swept("town", *scenario.world, scenario.route, options, stop);
}

}  // namespace understory::eval::experiments::loop_detectors
