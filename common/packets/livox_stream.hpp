// Packets of Livox lasers that speak the SDK2 protocol: Mid-360, HAP.
//
// After the Mid-360 communication protocol ("Point Cloud Data & IMU Data Protocol") and Livox-SDK2
// (`livox_lidar_def.h`): a header of 36 bytes, then points or one IMU sample. The pattern never
// repeats, so there are no revolutions: a sweep is what was measured within a period.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "common/packets/readings.hpp"
#include "common/packets/sensor_clock.hpp"
#include "common/packets/sweep_builder.hpp"

namespace understory::packets {

/// The models that are decoded.
enum class LivoxModel : std::uint8_t { kMid360, kHap };
/// By name: "mid360", "hap"; none for another.
std::optional<LivoxModel> livox_model(std::string_view name);
/// The name that livox_model() takes.
std::string_view to_string(LivoxModel model);

/// Where packets are sent to, UDP (Livox-SDK2, `define.h`).
struct LivoxPorts {
  std::uint16_t points = 56301;
  std::uint16_t imu = 56401;
};
/// Of a model as it comes.
LivoxPorts livox_ports(LivoxModel model);

/// Whether bytes are a point or IMU packet of the SDK2 protocol, whole and consistent.
bool is_livox_packet(std::span<const std::uint8_t> bytes);

/// Point and IMU packets in, sweeps of a fixed duration and IMU samples out, in frame `sensor` as
/// the laser has it (x forward, z up). Rings are the lines of the laser's emitters, as Livox's own
/// driver numbers them: point i of a packet is of line i modulo the number of lines.
class LivoxStream {
 public:
  /// `period_s`: duration of a sweep. Points at `max_range_m` and beyond are left out; 0 = the
  /// model's range.
  explicit LivoxStream(LivoxModel model, double period_s = 0.1, double max_range_m = 0.0);

  /// What this packet brought: an IMU sample, or the sweep that ends before it.
  Readings add(const Packet& packet);
  /// The sweep under way, where at least half of its period has passed.
  std::optional<model::PointSweep> finish();

  const StreamCounts& counts() const { return counts_; }  ///< Since the start.
  const SensorClock& clock() const { return clock_; }     ///< The sensor's.
  /// Of the IMU in the laser's frame; the HAP's is not published.
  std::optional<Eigen::Vector3d> imu_position_m() const;

 private:
  void add_points(const Packet& packet, Readings& readings);
  void add_imu(const Packet& packet, Readings& readings);
  void take_time(std::int64_t time_ns, model::Utime received);
  void end_sweep(std::vector<model::PointSweep>& sweeps);

  LivoxModel model_;
  std::uint16_t lines_;
  std::int64_t period_ns_;
  double max_range_m_;
  SensorClock clock_;
  SweepBuilder builder_;
  StreamCounts counts_;
  std::optional<std::int64_t> period_;  ///< Number of the sweep's period since the clock's zero.
  bool has_begin_ = false;              ///< The sweep under way began with its period.
  std::int64_t latest_ns_ = 0;          ///< Of the last point, sensor's clock.
  std::optional<std::uint16_t> packet_number_;
  std::uint64_t imu_samples_ = 0;
};

}  // namespace understory::packets
