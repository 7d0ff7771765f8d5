#include "common/foxglove/numbers.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "common/foxglove/scene.hpp"
#include "common/foxglove/schemas.hpp"
#include "common/terminal/printable.hpp"

namespace understory::foxglove {
namespace {

/// Output of a message's fields; each field is named once, for the message and for its schema.
class FieldSink {
 public:
  FieldSink() = default;
  FieldSink(const FieldSink&) = delete;
  FieldSink& operator=(const FieldSink&) = delete;
  virtual ~FieldSink() = default;
  virtual void time(model::Utime utime) = 0;
  virtual void number(std::string_view name, double value) = 0;  ///< Left out where unknown.
  virtual void count(std::string_view name, std::int64_t value) = 0;
  virtual void flag(std::string_view name, bool value) = 0;
  virtual void text(std::string_view name, std::string_view value) = 0;
};

class MessageSink final : public FieldSink {
 public:
  MessageSink() { out_.begin_object(); }
  void time(model::Utime utime) override { time_field(out_, "timestamp", utime); }
  void number(std::string_view name, double value) override {
    if (std::isfinite(value)) out_.field(name, value);
  }
  void count(std::string_view name, std::int64_t value) override { out_.field(name, value); }
  void flag(std::string_view name, bool value) override { out_.field(name, value); }
  void text(std::string_view name, std::string_view value) override {
    out_.field(name, terminal::printable(value));
  }
  std::string take() {
    out_.end_object();
    return out_.take();
  }

 private:
  JsonText out_;
};

class SchemaSink final : public FieldSink {
 public:
  void time(model::Utime) override { properties_.push_back({"timestamp", time_schema()}); }
  void number(std::string_view name, double) override {
    properties_.push_back({name, R"({"type":"number"})", false});
  }
  void count(std::string_view name, std::int64_t) override {
    properties_.push_back({name, R"({"type":"integer"})"});
  }
  void flag(std::string_view name, bool) override {
    properties_.push_back({name, R"({"type":"boolean"})"});
  }
  void text(std::string_view name, std::string_view) override {
    properties_.push_back({name, R"({"type":"string"})"});
  }
  std::string schema(std::string_view title) const { return object_schema(title, properties_); }

 private:
  std::vector<Property> properties_;
};

double degrees(double rad) { return rad * 180.0 / std::numbers::pi; }

double root(double variance) { return std::sqrt(std::max(0.0, variance)); }

/// Largest standard deviation of the position [m].
double largest_sigma(const Eigen::Matrix3d& covariance) {
  const Eigen::Matrix2d position = covariance.topLeftCorner<2, 2>();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(position, Eigen::EigenvaluesOnly);
  return root(solver.eigenvalues().maxCoeff());
}

/// Sigmas of a pose: x and y of the vehicle, the largest, the heading.
void append_sigmas(FieldSink& to, const Eigen::Matrix3d& covariance) {
  to.number("sigma_x_m", root(covariance(0, 0)));
  to.number("sigma_y_m", root(covariance(1, 1)));
  to.number("sigma_m", largest_sigma(covariance));
  to.number("sigma_heading_deg", degrees(root(covariance(2, 2))));
}

void append_fields(FieldSink& to, const PoseNumbers& numbers) {
  const model::SlamPose& pose = numbers.pose;
  const geometry::SE2 map_T_vehicle = pose.map_T_vehicle();
  to.time(pose.utime);
  to.text("status", status_text(pose));
  to.flag("is_localised", pose.is_localised());
  to.flag("is_provisional", pose.is_provisional);
  to.count("map_id", pose.map_id);
  to.count("submap_id", static_cast<std::int64_t>(pose.submap_id));
  to.count("correction_version", static_cast<std::int64_t>(pose.correction_version));
  to.count("reset_counter", static_cast<std::int64_t>(pose.reset_counter));
  to.number("x_m", map_T_vehicle.x());
  to.number("y_m", map_T_vehicle.y());
  to.number("heading_deg", degrees(map_T_vehicle.theta()));
  append_sigmas(to, pose.covariance);
  to.number("latency_s", numbers.latency_s);
  to.number("error_m", numbers.error_m);
  to.number("error_deg", numbers.error_deg);
}

std::string_view update_text(model::MapUpdateStatus status) {
  constexpr std::array<std::string_view, 5> kTexts{"first map", "updated", "not sure",
                                                   "rolled back", "rejected"};
  return kTexts[std::min<std::size_t>(static_cast<std::size_t>(status), kTexts.size() - 1)];
}

void append_fields(FieldSink& to, const model::MapUpdate& update) {
  const double freedom = update.degrees_of_freedom;
  to.time(update.utime);
  to.text("status", update_text(update.status));
  to.text("reason", update.reason);
  to.flag("used_prior", update.used_prior);
  to.count("keyframe", static_cast<std::int64_t>(update.keyframe_sequence));
  to.count("associations", static_cast<std::int64_t>(update.associations.size()));
  to.count("inliers", update.inliers);
  to.count("candidates", update.candidates);
  to.count("added", static_cast<std::int64_t>(update.added.size()));
  to.count("removed", static_cast<std::int64_t>(update.removed.size()));
  to.count("merged", static_cast<std::int64_t>(update.merged.size()));
  to.count("expected_not_seen", static_cast<std::int64_t>(update.expected.size()));
  to.number("nis", update.chi2);
  to.number("nis_degrees_of_freedom", freedom);
  to.number("nis_per_degree", update.chi2 / freedom);
  to.number("log10_false_alarm", update.log10_false_alarm);
}

void append_fields(FieldSink& to, const model::EkfPose& pose) {
  to.time(pose.utime);
  append_sigmas(to, pose.covariance);
  to.number("speed_mps", pose.velocity_mps.norm());
  to.number("sigma_speed_mps", root(pose.velocity_covariance.trace()));
  to.number("gyro_bias_radps", pose.bias[0]);
  to.number("accelerometer_bias_x_mps2", pose.bias[1]);
  to.number("accelerometer_bias_y_mps2", pose.bias[2]);
  to.count("landmarks_used", pose.landmarks_used);
  to.count("landmarks_refused", pose.landmarks_refused);
  to.count("reset_counter", static_cast<std::int64_t>(pose.reset_counter));
}

void append_fields(FieldSink& to, const model::Existence& existence) {
  to.time(existence.utime);
  to.count("map_id", existence.map_id);
  to.count("known", existence.known);
  to.count("unused", existence.unused);
  to.count("changed", static_cast<std::int64_t>(existence.landmarks.size()));
  to.number("missing_share", existence.missing_share);
  to.number("new_share", existence.new_share);
  to.flag("is_mapping_needed", existence.is_mapping_needed);
}

std::string_view health_text(int state) {
  constexpr std::array<std::string_view, 5> kTexts{"starting", "ok", "degraded", "error",
                                                   "stopping"};
  const bool is_known = state >= 0 && state < static_cast<int>(kTexts.size());
  return is_known ? kTexts[static_cast<std::size_t>(state)] : "unknown";
}

/// Sums over all channels of a process.
void append_channels(FieldSink& to, const std::vector<channel_health_t>& channels) {
  channel_health_t sum{};
  double in_hz = 0.0;
  double out_hz = 0.0;
  for (const channel_health_t& channel : channels) {
    sum.lost += channel.lost;
    sum.malformed += channel.malformed;
    sum.dropped += channel.dropped;
    (channel.output != 0 ? out_hz : in_hz) += channel.rate_hz;
  }

  to.number("in_hz", in_hz);
  to.number("out_hz", out_hz);
  to.count("lost", sum.lost);
  to.count("malformed", sum.malformed);
  to.count("dropped", sum.dropped);
}

void append_fields(FieldSink& to, const health_t& health) {
  to.time(health.utime);
  to.text("process", health.process);
  to.text("state", health_text(health.state));
  to.count("state_code", health.state);
  to.text("version", health.version);
  to.number("uptime_s", health.uptime_s);
  to.count("handled", health.handled);
  to.number("latency_p50_ms", 1e-3 * static_cast<double>(health.latency_p50_us));
  to.number("latency_p90_ms", 1e-3 * static_cast<double>(health.latency_p90_us));
  to.number("latency_p99_ms", 1e-3 * static_cast<double>(health.latency_p99_us));
  to.number("latency_max_ms", 1e-3 * static_cast<double>(health.latency_max_us));
  to.number("rss_mb", 1e-6 * static_cast<double>(health.rss_bytes));
  append_channels(to, health.channels);
  to.text("last_error_code", health.last_error_code);
  to.text("last_error", health.last_error);
}

void append_fields(FieldSink& to, const LoopNumbers& loop) {
  to.time(loop.utime);
  to.text("id", std::to_string(loop.closure_id));
  to.text("source", loop.source);
  to.text("status", loop.status);
  to.text("reason", loop.reason);
}

void append_fields(FieldSink& to, const model::ImuSample& sample) {
  constexpr std::array<std::string_view, 3> kRates{"rate_x_radps", "rate_y_radps", "rate_z_radps"};
  constexpr std::array<std::string_view, 3> kForces{"force_x_mps2", "force_y_mps2", "force_z_mps2"};
  to.time(sample.utime);
  for (int i = 0; i < 3; ++i) {
    to.number(kRates[static_cast<std::size_t>(i)], sample.angular_rate_rad_s[i]);
    to.number(kForces[static_cast<std::size_t>(i)], sample.specific_force_mps2[i]);
  }
}

template <class Message>
std::string message_json(const Message& message) {
  MessageSink sink;
  append_fields(sink, message);
  return sink.take();
}

template <class Message>
std::string message_schema(std::string_view title) {
  SchemaSink sink;
  append_fields(sink, Message{});
  return sink.schema(title);
}

}  // namespace

std::string_view status_text(const model::SlamPose& pose) {
  if (!pose.status) return pose.is_coasting ? "coasting" : "tracked";
  if (pose.is_lost) return "lost";
  if (pose.is_new_map) return "new map";
  return *pose.status == model::MapUpdateStatus::kUpdated ? "localised" : update_text(*pose.status);
}

std::string to_json(const PoseNumbers& numbers) { return message_json(numbers); }
std::string to_json(const model::MapUpdate& update) { return message_json(update); }
std::string to_json(const model::EkfPose& pose) { return message_json(pose); }
std::string to_json(const model::Existence& existence) { return message_json(existence); }
std::string to_json(const health_t& health) { return message_json(health); }
std::string to_json(const LoopNumbers& loop) { return message_json(loop); }
std::string to_json(const model::ImuSample& sample) { return message_json(sample); }

std::map<std::string_view, std::string> number_schemas() {
  return {{"understory.Pose", message_schema<PoseNumbers>("understory.Pose")},
          {"understory.Update", message_schema<model::MapUpdate>("understory.Update")},
          {"understory.Filter", message_schema<model::EkfPose>("understory.Filter")},
          {"understory.Existence", message_schema<model::Existence>("understory.Existence")},
          {"understory.Health", message_schema<health_t>("understory.Health")},
          {"understory.Loop", message_schema<LoopNumbers>("understory.Loop")},
          {"understory.Imu", message_schema<model::ImuSample>("understory.Imu")}};
}

}  // namespace understory::foxglove
