#include "services/lidar_imu_input/adapter.hpp"

#include <memory>
#include <optional>

#include "services/lidar_imu_input/adapter_parameters.hpp"
#include "services/lidar_imu_input/lidar_imu_input.hpp"

namespace understory {
namespace {

constexpr std::size_t kPointsPerPart = 4000;  // 10 bytes each: one message is well below 60 kB

Reason reason_of(InputFaultKind kind) {
  switch (kind) {
    case InputFaultKind::kNotFinite:
      return Reason::kNotFinite;
    case InputFaultKind::kLate:
      return Reason::kLate;
    case InputFaultKind::kClockJump:
      return Reason::kClockJump;
    case InputFaultKind::kSilent:
    case InputFaultKind::kNoMotion:
      return Reason::kSensorSilent;
    case InputFaultKind::kFrozen:
      return Reason::kSensorFrozen;
    case InputFaultKind::kSaturated:
      return Reason::kSaturated;
    case InputFaultKind::kNoPointTimes:
      return Reason::kNoPointTimes;
    case InputFaultKind::kNotCalibrated:
      return Reason::kNotCalibrated;
  }
  return Reason::kInconsistent;
}

class LidarImuInputAdapter : public Adapter {
 public:
  explicit LidarImuInputAdapter(LidarImuInputChannels channels) : channels_(std::move(channels)) {}

  void describe(ParameterTable& table) override {
    understory::describe(parameters_, axle_T_vehicle_, table);
  }

  void bind(Node& node) override {
    node_ = &node;
    parameters_.wheels.car.axle_T_vehicle =
        SE2(axle_T_vehicle_.x_m, axle_T_vehicle_.y_m, axle_T_vehicle_.yaw_rad);
    stage_.emplace(parameters_);
    take<ImuSample>(channels_.raw_imu, 4000);
    take<WheelSample>(channels_.raw_wheels, 2000);
    take<GnssFix>(channels_.raw_gnss, 200);
    take<PlanarScan>(channels_.raw_scan, 200);
    take<VelocityCorrection>(channels_.velocity_correction, 200);
    take<EkfPose>(channels_.ekf_pose, 200);
    // Bulk is no state: a sweep that was under way at a restart is lost.
    node.subscribe<PointSweep>(channels_.raw_sweep,
                               [this](const PointSweep& part) { add_part(part); },
                               {.queue_size = 1000, .journaled = false});
    imu_ = node.advertise<ImuSample>(channels_.imu);
    wheels_ = node.advertise<WheelSample>(channels_.wheels);
    gnss_ = node.advertise<GnssFix>(channels_.gnss);
    odometry_ = node.advertise<Odometry>(channels_.odometry);
    raw_pose_ = node.advertise<RawPose>(channels_.raw_pose);
    sweeps_ = node.advertise<PointSweep>(channels_.lidar_sweep);
    scans_ = node.advertise<PlanarScan>(channels_.lidar_scan);
  }

  void finish() override { publish(stage_->finish()); }
  std::string save() const override { return stage_->save(); }
  void load(const std::string& state) override { stage_->load(state); }

 private:
  template <class T>
  void take(const std::string& channel, std::size_t queue_size) {
    node_->subscribe<T>(channel, [this](const T& value) { publish(stage_->add(value)); },
                        {.queue_size = queue_size});
  }

  void add_part(const PointSweep& part) {
    auto sweep = assembler_.add(part);
    if (assembler_.incomplete_turns() > incomplete_) {
      incomplete_ = assembler_.incomplete_turns();
      node_->report(Reason::kPartsMissing, "a turn of which parts are missing is left out",
                    channels_.raw_sweep);
    }
    if (sweep) publish(stage_->add(*std::move(sweep)));
  }

  void publish(const InputResults& results) {
    for (const InputResult& result : results)
      std::visit([this](const auto& value) { send(value); }, result);
  }
  void send(const ImuSample& value) { imu_.publish(value); }
  void send(const WheelSample& value) { wheels_.publish(value); }
  void send(const GnssFix& value) { gnss_.publish(value); }
  void send(const Odometry& value) { odometry_.publish(value); }
  void send(const RawPose& value) { raw_pose_.publish(value); }
  void send(const PlanarScan& value) { scans_.publish(value); }
  void send(const PointSweep& value) {
    for (const PointSweep& part : split_sweep(value, kPointsPerPart)) sweeps_.publish(part);
  }
  void send(const InputFault& fault) {
    node_->report(reason_of(fault.kind), fault.text, fault.channel);
  }

  LidarImuInputChannels channels_;
  LidarImuInputParameters parameters_;
  AxlePlace axle_T_vehicle_;
  Node* node_ = nullptr;
  std::optional<LidarImuInput> stage_;
  SweepAssembler assembler_;
  std::uint64_t incomplete_ = 0;
  Publisher<ImuSample> imu_;
  Publisher<WheelSample> wheels_;
  Publisher<GnssFix> gnss_;
  Publisher<Odometry> odometry_;
  Publisher<RawPose> raw_pose_;
  Publisher<PointSweep> sweeps_;
  Publisher<PlanarScan> scans_;
};

}  // namespace

Service lidar_imu_input_service(const LidarImuInputChannels& channels) {
  return {"lidar_imu_input",
          channels.raw_imu + ", " + channels.raw_wheels + ", " + channels.raw_gnss + ", " +
              channels.raw_sweep + ", " + channels.raw_scan + ", " + channels.velocity_correction +
              ", " + channels.ekf_pose + " -> " + channels.imu + ", " + channels.wheels + ", " +
              channels.gnss + ", " + channels.odometry + ", " + channels.raw_pose + ", " +
              channels.lidar_sweep + ", " + channels.lidar_scan,
          [channels] { return std::make_unique<LidarImuInputAdapter>(channels); }};
}

}  // namespace understory
