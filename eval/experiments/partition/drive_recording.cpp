#include "eval/experiments/partition/drive_recording.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

#include "common/terminal/interrupt.hpp"
#include "eval/harness/chain_drive.hpp"
#include "sim/scenarios.hpp"
#include "sim/visible_landmarks.hpp"

namespace understory::eval::experiments::partition {
namespace {

/// Ideal keyframes: distance between them [m], scans that each stands for, least returns and walls
/// of a landmark, range [m].
constexpr double kIdealStep_m = 1.6;
constexpr std::uint16_t kIdealScans = 8;
constexpr std::uint32_t kLeastReturns = 8;
constexpr std::uint32_t kLeastWallReturns = 10;
constexpr double kIdealRange_m = 40.0;
constexpr double kDetection = 0.9;
/// Their noise: of a landmark [m], of odometry by its path, and of its heading [rad].
constexpr double kLandmarkSigma_m = 0.07;
constexpr double kOdometryShare = 0.01;
constexpr double kHeadingSigma_rad = 0.1 * std::numbers::pi / 180.0;
/// A lap of the block, and what one lap drives a second time.
constexpr double kLap_m = 710.0;

sim::Scenario scenario_of(const NamedRoute& route, std::uint64_t seed) {
  if (route.name == "urban") return sim::urban_scenario(1, seed, route.length_m - kLap_m);
  if (route.name == "urban-countryside")
    return sim::urban_to_countryside_scenario(route.length_m, seed);
  if (route.name == "countryside") return sim::countryside_scenario(route.length_m, seed);
  throw std::invalid_argument(route.name +
                              ": no such route (urban, urban-countryside, countryside)");
}

sim::SensorDrive sensors_of(const NamedRoute& route, std::uint64_t seed) {
  sim::SensorSuite suite;
  suite.gnss.reset();
  return {scenario_of(route, seed), sim::SpeedParameters{}, suite, seed};
}

/// Everything behind the sensors but the mapper.
RecordedDrive record_lidar(const NamedRoute& route, std::uint64_t seed,
                           const RecordingOptions& options, const std::atomic<bool>& stop) {
  sim::SensorDrive sensors = sensors_of(route, seed);
  std::vector<bus::Service> services = harness::services_of(options.config_dir);
  std::erase_if(services, [](const bus::Service& one) { return one.name == "geoslam_mapper"; });
  harness::SensorChain chain(services, options.config_dir);

  RecordedDrive drive;
  const auto keep = [&drive](const auto& message) { drive.inputs.emplace_back(message); };
  chain.watch<model::Odometry>("ODOMETRY", keep);
  chain.watch<model::RestLevel>("REST_LEVEL", keep);
  chain.watch<model::EkfPose>("EKF_POSE", keep);
  chain.watch<model::EkfLevel>("EKF_LEVEL", keep);
  chain.watch<model::Keyframe>("KEYFRAME", keep);

  std::uint64_t sweep_parts = 0;
  while (const auto reading = sensors.next()) {
    if (stop) throw terminal::Interrupted();
    if (const auto* truth = std::get_if<sim::TruePose>(&*reading))
      drive.truth.push_back({truth->utime, truth->state.world_T_level()});
    for (const harness::RawMessage& message : harness::raw_messages(*reading, sweep_parts))
      chain.feed(message);
  }
  chain.finish();
  return drive;
}

/// Keyframes and odometry from the truth.
class IdealDrive {
 public:
  IdealDrive(const NamedRoute& route, std::uint64_t seed)
      : sensors_(sensors_of(route, seed)), random_(seed) {}

  RecordedDrive run(const std::atomic<bool>& stop) {
    std::optional<geometry::SE2> last;
    for (std::uint64_t revolution = 0; revolution < sensors_.sweep_count(); ++revolution) {
      if (stop) throw terminal::Interrupted();
      const auto utime = static_cast<model::Utime>(1e6 * sensors_.suite().lidar->revolution_s() *
                                                   static_cast<double>(revolution + 1));
      const sim::VehicleState state = sensors_.state_at(utime);
      const geometry::SE2 here = state.world_T_level();
      drive_.truth.push_back({utime, here});
      if (last && (here.translation() - last->translation()).norm() < kIdealStep_m) continue;

      if (last) add_odometry(last->inverse() * here, utime);
      add_keyframe(sensors_.sweep(revolution), state, utime);
      last = here;
    }
    return std::move(drive_);
  }

 private:
  double unit() { return normal_(random_); }

  void add_odometry(const geometry::SE2& from_T_to, model::Utime utime) {
    const double way_m = from_T_to.translation().norm();
    const Eigen::Vector3d sigma(kOdometryShare * way_m, 0.2 * kOdometryShare * way_m,
                                kHeadingSigma_rad);
    model::Odometry out;
    out.from_utime = last_utime_;
    out.utime = utime;
    out.sequence = sequence_;
    const Eigen::Vector3d noise = sigma.cwiseProduct(Eigen::Vector3d(unit(), unit(), unit()));
    out.from_T_to = from_T_to * geometry::SE2::Exp(noise);
    out.covariance = sigma.array().square().matrix().asDiagonal();
    out.has_wheels = true;
    drive_.inputs.emplace_back(out);
  }

  void add_keyframe(const sim::SimulatedSweep& sweep, const sim::VehicleState& state,
                    model::Utime utime) {
    model::Keyframe out;
    out.utime = utime;
    out.sequence = ++sequence_;
    out.field_of_view.max_range_m = kIdealRange_m;
    out.members.push_back({utime, sequence_, {}, 1e-10 * Eigen::Matrix3d::Identity()});
    for (const sim::VisibleTrunk& trunk :
         visible_trunks(sensors_.world(), sweep, state, kLeastReturns)) {
      add_landmark(trunk.centre_m.head<2>(), trunk.radius_m, model::LandmarkKind::kTrunk, out);
    }
    for (const sim::VisibleCorner& corner : visible_corners(sensors_.world(), sweep, state)) {
      if (corner.returns_before < kLeastWallReturns || corner.returns_after < kLeastWallReturns)
        continue;
      add_landmark(corner.position_m.head<2>(), 0.0, model::LandmarkKind::kCorner, out);
    }
    drive_.inputs.emplace_back(std::move(out));
    last_utime_ = utime;
  }

  void add_landmark(const Eigen::Vector2d& truth_m, double radius_m, model::LandmarkKind kind,
                    model::Keyframe& keyframe) {
    const bool is_seen = chance_(random_) <= kDetection && truth_m.norm() <= kIdealRange_m;
    const Eigen::Vector2d noise(unit(), unit());
    if (!is_seen) return;
    model::KeyframeLandmark& out = keyframe.landmarks.emplace_back();
    out.position_m = truth_m + kLandmarkSigma_m * noise;
    out.covariance_m2 = kLandmarkSigma_m * kLandmarkSigma_m * Eigen::Matrix2d::Identity();
    out.radius_m = radius_m;
    out.kind = kind;
    out.observation_count = kIdealScans;
  }

  sim::SensorDrive sensors_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_{0.0, 1.0};
  std::uniform_real_distribution<double> chance_{0.0, 1.0};
  RecordedDrive drive_;
  model::Utime last_utime_ = 0;
  std::uint64_t sequence_ = 0;
};

}  // namespace

RecordedDrive record(const NamedRoute& route, FrontEnd front_end, std::uint64_t seed,
                     const RecordingOptions& options, const std::atomic<bool>& stop) {
  const char* name = front_end == FrontEnd::kIdeal ? "ideal" : "lidar";
  const std::filesystem::path file =
      options.folder.empty() ? std::filesystem::path()
                             : options.folder / fmt::format("{}-{}-{:.0f}m-{}.lcm", name,
                                                            route.name, route.length_m, seed);
  if (!file.empty() && std::filesystem::exists(file)) return load(file);

  RecordedDrive drive = front_end == FrontEnd::kIdeal ? IdealDrive(route, seed).run(stop)
                                                      : record_lidar(route, seed, options, stop);
  if (!file.empty()) {
    std::filesystem::create_directories(options.folder);
    save(drive, file);
  }
  return drive;
}

}  // namespace understory::eval::experiments::partition
