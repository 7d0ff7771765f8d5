#include "eval/experiments/laps/laps.hpp"

#include <fmt/format.h>
#include <malloc.h>

#include <Eigen/LU>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include "common/bus/config_layers.hpp"
#include "common/bus/launch_config.hpp"
#include "common/map_file/map_file.hpp"
#include "common/model/slam_output.hpp"
#include "common/terminal/interrupt.hpp"
#include "eval/harness/chain_drive.hpp"
#include "eval/tools/quantile.hpp"
#include "services/geoslam_mapper/adapter.hpp"
#include "services/keyframer/adapter.hpp"
#include "sim/scenarios.hpp"

namespace understory::eval::experiments::laps {
namespace {

constexpr const char* kMapper = "geoslam_mapper";
constexpr double kStandstill_s = 22.0;
/// Time of drive of one row of the repeated lap.
constexpr double kStretch_h = 0.5;
/// Between the last scan of a repeated lap and the first of the next.
constexpr model::Utime kScan_us = 100'000;

using Truth = std::function<geometry::SE2(model::Utime)>;

double mib_of(const std::string& bytes) {
  return static_cast<double>(bytes.size()) / (1024.0 * 1024.0);
}

double heap_mib() {
  const struct mallinfo2 info = ::mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd) / (1024.0 * 1024.0);
}

/// What the measurement itself keeps: the lap that is recorded.
double mib_of(const RecordedLap& recorded) {
  constexpr std::size_t kOfABlock = 16;  // that the allocator adds
  std::size_t bytes = recorded.messages.capacity() * sizeof(harness::RawMessage) + kOfABlock;
  for (const harness::RawMessage& message : recorded.messages)
    bytes += message.bytes.capacity() + kOfABlock;
  return static_cast<double>(bytes) / (1024.0 * 1024.0);
}

/// The mapper's configuration with what the options ask for; `localises`: only in their map.
std::map<std::string, std::string> toml_instead(const LapsOptions& options, bool localises) {
  toml::table values;
  toml::table smoothing;
  if (options.known_ground_m >= 0.0) smoothing.insert("known_ground_m", options.known_ground_m);
  if (localises) {
    smoothing.insert("localisation_only", true);
    values.insert("input", toml::table{{"map_file", options.localise_in.string()}});
  }
  if (smoothing.empty()) return {};
  values.insert("smoothing", std::move(smoothing));
  return {{kMapper, bus::layer_over(bus::config_file_in(options.config_dir, kMapper), values)}};
}

std::vector<bus::Service> mapping_services() {
  return {keyframer::keyframer_service(), geoslam_mapper::geoslam_mapper_service()};
}

/// Sums up what one lap gives; nothing in it grows.
class LapCounter {
 public:
  LapCounter(harness::SensorChain& chain, Truth truth) : chain_(chain), truth_(std::move(truth)) {
    chain.watch<model::SlamPose>("SLAM_POSE", [this](const model::SlamPose& pose) { add(pose); });
    chain.watch<model::MapUpdate>("SLAM_UPDATE", [this](const model::MapUpdate& update) {
      ++(metrics::localised(update) ? lap_.keyframes : lap_.refused);
    });
  }

  /// The sums since the last call.
  Lap take(int number, double hours, const RecordedLap& recorded) {
    const auto poses = static_cast<double>(std::max<std::size_t>(lap_.poses, 1));
    lap_.number = number;
    lap_.hours = hours;
    lap_.ate_m = std::sqrt(squared_m2_ / poses);
    lap_.mean_nees = nees_ / poses;

    std::vector<double> times_ms;
    for (const float one : chain_.take_calls_ms(kMapper)) times_ms.push_back(one);
    lap_.mapper_p99_ms = tools::quantile(times_ms, 0.99);
    lap_.mapper_largest_ms = tools::quantile(times_ms, 1.0);
    for (const std::string& service : chain_.services()) (void)chain_.take_calls_ms(service);
    times_ms = {};
    lap_.heap_mib = heap_mib() - mib_of(recorded);
    lap_.mapper_state_mib = mib_of(chain_.state_of(kMapper));

    squared_m2_ = nees_ = 0.0;
    return std::exchange(lap_, Lap{});
  }

 private:
  void add(const model::SlamPose& pose) {
    if (!pose.is_localised()) {
      ++lap_.unsure;
      return;
    }
    const geometry::SE2 map_T_vehicle = pose.map_T_vehicle();
    const geometry::SE2 truth = truth_(pose.utime);
    if (!map_T_world_) map_T_world_ = map_T_vehicle * truth.inverse();

    const Eigen::Vector3d error = (map_T_vehicle.inverse() * *map_T_world_ * truth).coordinates();
    const Eigen::Matrix3d covariance = pose.covariance + 1e-12 * Eigen::Matrix3d::Identity();
    squared_m2_ += error.head<2>().squaredNorm();
    const double nees = error.dot(covariance.inverse() * error);
    nees_ += nees;
    lap_.largest_nees = std::max(lap_.largest_nees, nees);
    ++lap_.poses;
  }

  harness::SensorChain& chain_;
  Truth truth_;
  std::optional<geometry::SE2> map_T_world_;  ///< The first pose's frame.
  Lap lap_;
  double squared_m2_ = 0.0;
  double nees_ = 0.0;
};

sim::SensorDrive make_drive(const LapsOptions& options) {
  sim::ForestScenarioParameters forest;
  forest.length_m = options.length_m;
  forest.laps = options.laps;
  sim::SensorSuite suite;
  suite.gnss.reset();
  if (options.beams == 16)
    suite.lidar->elevations_rad = sim::beam_elevations_rad(sim::LidarModel::kVlp16);
  sim::SpeedParameters speed;
  speed.standstill_s = kStandstill_s;
  return {sim::forest_scenario(forest, options.seed), speed, suite, options.seed};
}

/// Keeps the messages between the two boundaries of the last lap.
class Recorder {
 public:
  Recorder(harness::SensorChain& chain, RecordedLap& to) : to_(to) {
    keep<model::LandmarkScan>(chain, "LANDMARKS");
    keep<model::Odometry>(chain, "ODOMETRY");
    keep<model::EkfPose>(chain, "EKF_POSE");
    keep<model::EkfLevel>(chain, "EKF_LEVEL");
  }
  void set_recording(bool on) { is_on_ = on; }

 private:
  template <class T>
  void keep(harness::SensorChain& chain, const char* channel) {
    chain.watch<T>(channel, [this, channel](const T& value) {
      if (is_on_) to_.messages.push_back({value.utime, channel, wire::encode_message(value)});
    });
  }
  RecordedLap& to_;
  bool is_on_ = false;
};

template <class T>
wire::Bytes later(const wire::Bytes& bytes, model::Utime by_us, std::uint64_t sequence) {
  T value = *wire::decode_message<T>(bytes);
  value.utime += by_us;
  value.sequence = sequence;
  if constexpr (requires { value.from_utime; }) value.from_utime += by_us;
  return wire::encode_message(value);
}

wire::Bytes later(const harness::RawMessage& message, model::Utime by_us, std::uint64_t sequence) {
  if (message.channel == "LANDMARKS")
    return later<model::LandmarkScan>(message.bytes, by_us, sequence);
  if (message.channel == "ODOMETRY") return later<model::Odometry>(message.bytes, by_us, sequence);
  if (message.channel == "EKF_POSE") return later<model::EkfPose>(message.bytes, by_us, sequence);
  return later<model::EkfLevel>(message.bytes, by_us, sequence);
}

}  // namespace

std::vector<Lap> drive_laps(const LapsOptions& options, const std::atomic<bool>& stop,
                            RecordedLap& recorded, const std::function<void(const Lap&)>& done) {
  std::vector<Lap> laps;
  sim::SensorDrive drive = make_drive(options);
  harness::SensorChain chain(harness::services_of(options.config_dir), options.config_dir,
                             toml_instead(options, false));
  LapCounter counter(chain,
                     [&](model::Utime utime) { return drive.state_at(utime).world_T_level(); });
  Recorder recorder(chain, recorded);
  const auto end_lap = [&](int number, double hours) {
    laps.push_back(counter.take(number, hours, recorded));
    done(laps.back());
  };

  std::optional<Eigen::Vector2d> last;
  std::uint64_t sweep_parts = 0;
  double driven_m = 0.0;
  double now_s = 0.0;
  while (const auto reading = drive.next()) {
    if (stop) throw terminal::Interrupted();
    if (const auto* truth = std::get_if<sim::TruePose>(&*reading)) {
      const Eigen::Vector2d here = truth->state.position_m.head<2>();
      if (last) driven_m += (here - *last).norm();
      last = here;
      now_s = 1e-6 * static_cast<double>(truth->utime);
    }
    // The last lap but one is whole: none of it is accelerated or braked.
    const auto lap = static_cast<int>(driven_m / options.length_m);
    recorder.set_recording(lap == options.laps - 2);
    for (const harness::RawMessage& message : harness::raw_messages(*reading, sweep_parts))
      chain.feed(message);
    if (lap > static_cast<int>(laps.size())) end_lap(lap, now_s / 3600.0);
  }
  chain.finish();
  if (static_cast<int>(laps.size()) < options.laps) end_lap(options.laps, now_s / 3600.0);
  return laps;
}

void write_lap_map(const LapsOptions& options, const RecordedLap& recorded) {
  if (std::filesystem::exists(options.localise_in)) return;
  harness::SensorChain chain(mapping_services(), options.config_dir, toml_instead(options, false));
  model::WholeMap whole;
  chain.watch<model::WholeMap>("MAP", [&](const model::WholeMap& map) { whole = map; });
  for (const harness::RawMessage& message : recorded.messages) chain.feed(message);
  chain.finish();
  if (whole.landmarks.empty()) throw std::runtime_error("the recorded lap gave no map");

  map_file::StoredMap map;
  map.map_id = model::map_of(whole.landmarks.back().id);
  map.name = "lap";
  map.created_utime = whole.utime;
  map.keyframes = whole.keyframes;
  for (const model::MapLandmark& landmark : whole.landmarks)
    map.landmarks.push_back({landmark, std::nullopt, std::nullopt});
  map_file::create_map_file(options.localise_in, {&map, 1},
                            {whole.utime, "understory eval laps", "a recorded lap", "its map"});
}

std::vector<Lap> repeat_lap(const LapsOptions& options, const std::atomic<bool>& stop,
                            const RecordedLap& recorded, std::uint64_t& map_changes,
                            const std::function<void(const Lap&)>& done) {
  const std::vector<harness::RawMessage>& messages = recorded.messages;
  if (messages.empty()) throw std::runtime_error("three laps or more are needed");
  const model::Utime begin_us = messages.front().utime;
  const model::Utime lap_us = messages.back().utime - begin_us + kScan_us;
  const sim::SensorDrive drive = make_drive(options);
  harness::SensorChain chain(mapping_services(), options.config_dir,
                             toml_instead(options, !options.localise_in.empty()));
  chain.watch<model::MapDelta>("MAP_DELTA",
                               [&](const model::MapDelta& /*delta*/) { ++map_changes; });

  LapCounter counter(chain, [&](model::Utime utime) {
    return drive.state_at(begin_us + (utime - begin_us) % lap_us).world_T_level();
  });
  std::vector<Lap> stretches;
  std::uint64_t repeated = 0;
  const auto hours_of = [&](std::uint64_t laps) {
    return static_cast<double>(laps) * static_cast<double>(lap_us) / 3.6e9;
  };
  while (hours_of(repeated) < options.hours) {
    if (stop) throw terminal::Interrupted();
    const model::Utime shift_us = static_cast<model::Utime>(repeated) * lap_us;
    std::uint64_t sequence = repeated * messages.size();
    for (const harness::RawMessage& message : messages)
      chain.feed(message.channel, later(message, shift_us, sequence++));

    const double hours = hours_of(++repeated);
    const auto rows = static_cast<int>(stretches.size());
    if (hours < kStretch_h * (rows + 1) && hours < options.hours) continue;
    stretches.push_back(counter.take(rows + 1, hours, recorded));
    done(stretches.back());
  }
  return stretches;
}

}  // namespace understory::eval::experiments::laps
