#include "services/lidar_imu_input/adapter.hpp"

#include <memory>
#include <optional>

#include "services/lidar_imu_input/adapter_parameters.hpp"
#include "services/lidar_imu_input/lidar_imu_input.hpp"

namespace understory::lidar_imu_input {
namespace {

constexpr std::size_t kPointsPerPart = 4000;  // 10 bytes each: one message is well below 60 kB

wire::Reason reason_of(InputFaultKind kind) {
  switch (kind) {
    case InputFaultKind::kNotFinite:
      return wire::Reason::kNotFinite;
    case InputFaultKind::kLate:
      return wire::Reason::kLate;
    case InputFaultKind::kClockJump:
      return wire::Reason::kClockJump;
    case InputFaultKind::kPaused:
      return wire::Reason::kRestarted;
    case InputFaultKind::kNoMotion:
      return wire::Reason::kNoMotion;
    case InputFaultKind::kSilent:
      return wire::Reason::kSensorSilent;  // Told as a condition, see show_silence().
    case InputFaultKind::kUnit:
      return wire::Reason::kMiscalibrated;
    case InputFaultKind::kFrozen:
      return wire::Reason::kSensorFrozen;
    case InputFaultKind::kSaturated:
      return wire::Reason::kSaturated;
    case InputFaultKind::kNoPointTimes:
      return wire::Reason::kNoPointTimes;
    case InputFaultKind::kNotCalibrated:
      return wire::Reason::kNotCalibrated;
  }
  return wire::Reason::kInconsistent;
}

/// Every output on its channel; faults into HEALTH.
class Publishers {
 public:
  Publishers(bus::Node& node, const LidarImuInputChannels& channels)
      : node_(&node),
        imu_(node.advertise<model::ImuSample>(channels.imu)),
        wheels_(node.advertise<model::WheelSample>(channels.wheels)),
        gnss_(node.advertise<model::GnssFix>(channels.gnss)),
        odometry_(node.advertise<model::Odometry>(channels.odometry)),
        rest_levels_(node.advertise<model::RestLevel>(channels.rest_level)),
        raw_pose_(node.advertise<model::RawPose>(channels.raw_pose)),
        sweeps_(node.advertise<model::PointSweep>(channels.lidar_sweep)),
        scans_(node.advertise<model::PlanarScan>(channels.lidar_scan)) {}

  void operator()(const model::ImuSample& value) { imu_.publish(value); }
  void operator()(const model::WheelSample& value) { wheels_.publish(value); }
  void operator()(const model::GnssFix& value) { gnss_.publish(value); }
  void operator()(const model::Odometry& value) { odometry_.publish(value); }
  void operator()(const model::RestLevel& value) { rest_levels_.publish(value); }
  void operator()(const model::RawPose& value) { raw_pose_.publish(value); }
  void operator()(const model::PlanarScan& value) { scans_.publish(value); }
  void operator()(const model::PointSweep& value) {
    for (const model::PointSweep& part : split_sweep(value, kPointsPerPart)) sweeps_.publish(part);
  }
  void operator()(const InputFault& fault) {
    if (fault.kind == InputFaultKind::kSilent) return;  // HEALTH says so as long as it lasts.
    node_->report(reason_of(fault.kind), fault.text, fault.channel);
  }

 private:
  bus::Node* node_;
  bus::Publisher<model::ImuSample> imu_;
  bus::Publisher<model::WheelSample> wheels_;
  bus::Publisher<model::GnssFix> gnss_;
  bus::Publisher<model::Odometry> odometry_;
  bus::Publisher<model::RestLevel> rest_levels_;
  bus::Publisher<model::RawPose> raw_pose_;
  bus::Publisher<model::PointSweep> sweeps_;
  bus::Publisher<model::PlanarScan> scans_;
};

class LidarImuInputAdapter : public bus::Adapter {
 public:
  explicit LidarImuInputAdapter(LidarImuInputChannels channels) : channels_(std::move(channels)) {}

  void describe(bus::ParameterTable& table) override {
    lidar_imu_input::describe(parameters_, axle_T_vehicle_, table);
  }

  void bind(bus::Node& node) override {
    node_ = &node;
    publishers_.emplace(node, channels_);
    parameters_.wheels.car.axle_T_vehicle =
        geometry::SE2(axle_T_vehicle_.x_m, axle_T_vehicle_.y_m, axle_T_vehicle_.yaw_rad);
    stage_.emplace(parameters_);

    // The stage puts late ones in order.
    const auto sensor = [](std::size_t queue_size, bool is_expected) {
      return bus::SubscribeOptions{
          .queue_size = queue_size, .takes_late = true, .cadence = cadence(is_expected)};
    };
    take<model::ImuSample>(channels_.raw_imu, sensor(4000, parameters_.expected.imu));
    take<model::WheelSample>(channels_.raw_wheels, sensor(2000, parameters_.expected.wheels));
    take<model::PlanarScan>(channels_.raw_scan, sensor(200, parameters_.expected.scan));
    take<model::GnssFix>(channels_.raw_gnss, {.queue_size = 200, .takes_late = true});

    // What comes back is on the stage's time, also where the sensors' clocks have jumped.
    const bus::SubscribeOptions feedback{.queue_size = 200, .timed = false};
    take<model::VelocityCorrection>(channels_.velocity_correction, feedback);
    take<model::EkfPose>(channels_.ekf_pose, feedback);
    // Bulk is no state: a sweep that arrives in part before a restart is lost.
    node.subscribe<model::PointSweep>(channels_.raw_sweep,
                                      [this](const model::PointSweep& part) { add_part(part); },
                                      {.queue_size = 1000,
                                       .takes_late = true,
                                       .journaled = false,
                                       .cadence = cadence(parameters_.expected.sweep)});
  }

  void finish() override { publish(stage_->finish()); }
  std::string save() const override { return stage_->save(); }
  void load(const std::string& state) override {
    stage_->load(state);
    show_silence();
    show_calibration();
  }

 private:
  template <class T>
  void take(const std::string& channel, const bus::SubscribeOptions& options) {
    node_->subscribe<T>(
        channel, [this](const T& value) { publish(stage_->add(value)); }, options);
  }

  void add_part(const model::PointSweep& part) {
    auto sweep = assembler_.add(part);
    if (assembler_.incomplete_revolutions() > incomplete_) {
      incomplete_ = assembler_.incomplete_revolutions();
      node_->report(wire::Reason::kPartsMissing, "a sweep of which parts are missing is left out",
                    channels_.raw_sweep);
    }
    if (sweep) publish(stage_->add(*std::move(sweep)));
  }

  void publish(const InputResults& results) {
    for (const InputResult& result : results) std::visit(*publishers_, result);
    show_silence();
    show_calibration();
  }

  /// As long as a sensor contradicts gravity, the ground or the others.
  void show_calibration() {
    const MotionAgreement& agreement = stage_->agreement();
    const std::string by_motion = agreement.text();
    const bool is_of_imu = MotionAgreement::is_of_imu(agreement.odd());
    const std::string by_gravity = stage_->gravity().text();
    show_miscalibrated(channels_.raw_imu, by_gravity.empty() && is_of_imu ? by_motion : by_gravity);
    show_miscalibrated(channels_.raw_wheels, is_of_imu ? "" : by_motion);
    show_miscalibrated(channels_.raw_sweep, stage_->laser().text());
  }
  void show_miscalibrated(const std::string& channel, const std::string& text) {
    bus::WatchedCondition watched{wire::Reason::kMiscalibrated, text, channel,
                                  bus::Condition({1, 1})};
    watched.condition.add(!text.empty());
    node_->show(watched);
  }

  static bus::Cadence cadence(bool is_expected) {
    return is_expected ? bus::Cadence::kExpected : bus::Cadence::kSteady;
  }

  /// HEALTH is not OK as long as a sensor is silent beside the others.
  void show_silence() {
    const std::pair<Sensor, std::string_view> sensors[] = {{Sensor::kImu, channels_.raw_imu},
                                                           {Sensor::kWheels, channels_.raw_wheels},
                                                           {Sensor::kSweep, channels_.raw_sweep},
                                                           {Sensor::kScan, channels_.raw_scan}};
    for (const auto& [sensor, channel] : sensors) {
      bus::WatchedCondition watched{wire::Reason::kSensorSilent,
                                    "nothing comes from this sensor, the others go on", channel,
                                    bus::Condition({1, 1})};
      watched.condition.add(stage_->is_silent(sensor));
      node_->show(watched);
    }
  }

  LidarImuInputChannels channels_;
  LidarImuInputParameters parameters_;
  AxlePlace axle_T_vehicle_;
  bus::Node* node_ = nullptr;
  std::optional<LidarImuInput> stage_;
  model::SweepAssembler assembler_;
  std::uint64_t incomplete_ = 0;  ///< Sweeps with missing parts that were reported.
  std::optional<Publishers> publishers_;
};

}  // namespace

bus::Service lidar_imu_input_service(const LidarImuInputChannels& channels) {
  return {"lidar_imu_input", channels.all,
          [channels] { return std::make_unique<LidarImuInputAdapter>(channels); }};
}

}  // namespace understory::lidar_imu_input
