// Packets of Livox lasers (`livox_packet.hpp`). The pattern never repeats, so there are no
// revolutions: a sweep contains the points of one period.
#pragma once

#include <cstdint>
#include <optional>

#include "common/packets/livox_packet.hpp"
#include "common/packets/readings.hpp"
#include "common/packets/sensor_clock.hpp"
#include "common/packets/sweep_builder.hpp"

namespace understory::packets {

/// UDP destination ports of packets (Livox-SDK2, `define.h`).
struct LivoxPorts {
  std::uint16_t points = 56301;
  std::uint16_t imu = 56401;
};
/// Default ports of an SDK2 model; 0 for SDK1, where laser and host negotiate them.
LivoxPorts livox_ports(LivoxModel model);

/// Input: point and IMU packets; output: sweeps of fixed duration and IMU samples in the laser's
/// own frame `sensor` (x forward, z up). Rings are the lines of the laser's emitters, numbered as
/// in Livox's driver: point i of a packet belongs to line i modulo the number of lines.
class LivoxStream {
 public:
  /// `period_s`: duration of a sweep. Points at `max_range_m` and beyond are left out; 0 = the
  /// model's range.
  explicit LivoxStream(LivoxModel model, double period_s = 0.1, double max_range_m = 0.0);

  /// Adds a packet; returns an IMU sample, or the sweep that ends before it.
  Readings add(const Packet& packet);
  /// The present sweep, if at least half of its period has passed.
  std::optional<model::PointSweep> finish();

  const StreamCounts& counts() const { return counts_; }  ///< Counts since the start.
  const SensorClock& clock() const { return clock_; }     ///< The sensor's clock.
  /// Position of the IMU in the laser's frame; the HAP's is not published.
  std::optional<Eigen::Vector3d> imu_position_m() const;

 private:
  void add_points(const Packet& packet, const LivoxHeader& header, Readings& readings);
  void add_imu(const Packet& packet, const LivoxHeader& header, Readings& readings);
  void count_gap(const LivoxHeader& header);
  void take_time(std::int64_t time_ns, model::Utime received);
  void end_sweep(std::vector<model::PointSweep>& sweeps);

  LivoxModel model_;
  LivoxProperties properties_;
  std::int64_t period_ns_;
  double max_range_m_;
  SensorClock clock_;
  SweepBuilder builder_;
  StreamCounts counts_;
  std::optional<std::int64_t> period_;  ///< Number of the sweep's period since the clock's zero.
  bool has_begin_ = false;              ///< The present sweep began with its period.
  std::int64_t latest_ns_ = 0;          ///< Time of the last point, sensor's clock.
  std::optional<std::uint16_t> packet_number_;
  std::optional<std::int64_t>
      next_ns_;  ///< Start time of the next packet of points, if none is lost.
  std::uint64_t imu_samples_ = 0;
};

}  // namespace understory::packets
