#include "services/keyframer/adapter.hpp"

#include <fmt/format.h>

#include <memory>
#include <numbers>

#include "common/bus/watched_adapter.hpp"
#include "services/keyframer/adapter_parameters.hpp"
#include "services/keyframer/health_watch.hpp"
#include "services/keyframer/joint/joint_keyframer.hpp"

namespace understory::keyframer {
namespace {

class KeyframerAdapter : public bus::WatchedAdapter<joint::JointKeyframer, KeyframerParameters,
                                                    HealthWatch, HealthParameters> {
 public:
  explicit KeyframerAdapter(KeyframerChannels channels)
      : WatchedAdapter({"keyframer_service", 4}), channels_(std::move(channels)) {}

  void bind(bus::Node& node) override {
    begin(node, parameters_.joint);

    node.subscribe<model::LandmarkScan>(channels_.landmarks,
                                        [this](const model::LandmarkScan& scan) { add(scan); },
                                        {.queue_size = 200, .most_bytes = most_bytes()});
    // Increments are small, but a lost one is a gap in the motion: a long queue.
    node.subscribe<model::Odometry>(channels_.odometry,
                                    [this](const model::Odometry& motion) { stage_->add(motion); },
                                    {.queue_size = 2000});
    node.subscribe<model::EkfLevel>(channels_.ekf_level,
                                    [this](const model::EkfLevel& level) { stage_->add(level); });

    keyframes_ = node.advertise<model::Keyframe>(channels_.keyframe);
  }

 private:
  void add(const model::LandmarkScan& scan) {
    const KeyframerCounters before = stage_->counters();
    const auto keyframe = stage_->add(scan);
    const bool was_miscalibrated = watch_.is_miscalibrated();
    watch_.add(scan, before, stage_->counters(), stage_->input_quality());
    if (!was_miscalibrated && watch_.is_miscalibrated()) log(stage_->input_quality());
    for (const model::Keyframe& waited : stage_->take_waited()) keyframes_.publish(waited);
    if (keyframe) keyframes_.publish(*keyframe);
    show_health();
  }

  /// The numbers, for correcting the configuration.
  void log(const InputQuality& quality) {
    log(quality.calibration, "minutes");
    log(quality.lately, "seconds");
  }
  void log(const CalibrationError& error, std::string_view by) {
    const double degrees = 180.0 / std::numbers::pi;
    node_->log(
        bus::Node::Level::kWarning, "miscalibrated",
        fmt::format(
            "landmarks against wheels by the last {}: yaw {:.2f} +- {:.2f} deg, ahead {:.3f} +- "
            "{:.3f} m, left {:.3f} +- {:.3f} m, way by wheels {:+.2f} +- {:.2f} %, scans late by "
            "{:.1f} +- {:.1f} ms",
            by, degrees * error.yaw_rad, degrees * error.yaw_sigma_rad, error.place_m.x(),
            error.place_sigma_m.x(), error.place_m.y(), error.place_sigma_m.y(),
            100.0 * error.scale, 100.0 * error.scale_sigma, 1e3 * error.late_s,
            1e3 * error.late_sigma_s),
        channels_.landmarks);
  }

  std::size_t most_bytes() const {
    return wire::bytes_with<landmarks_t, detection_t>(
        static_cast<std::size_t>(parameters_.max_detections));
  }

  KeyframerChannels channels_;
  bus::Publisher<model::Keyframe> keyframes_;
};

}  // namespace

bus::Service keyframer_service(const KeyframerChannels& channels) {
  return {"keyframer", channels.all,
          [channels] { return std::make_unique<KeyframerAdapter>(channels); }};
}

}  // namespace understory::keyframer
