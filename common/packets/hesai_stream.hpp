// Packets of Hesai lasers: Pandar40P, Pandar64, PandarQT, PandarXT-16, PandarXT-32, XT32M2X.
//
// A packet has blocks of (azimuth, beams x (distance, reflectivity, ...)), and in its tail a date
// (UTC, to the second) and microseconds. Returns of one firing are blocks of the same azimuth.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/packets/hesai_model.hpp"
#include "common/packets/readings.hpp"
#include "common/packets/sensor_clock.hpp"
#include "common/packets/sweep_builder.hpp"

namespace understory::packets {

constexpr std::uint16_t kHesaiPort = 2368;

/// Input: point packets; output: complete revolutions in frame `sensor` (x forward = azimuth 0, y
/// left, z up; Hesai's own axes have y at azimuth 0). Two or three returns give all different
/// points.
class HesaiStream {
 public:
  /// `beams`: those of the model, or from the sensor's angle correction file. Points at
  /// `max_range_m` and beyond are left out; 0 = the model's range.
  HesaiStream(HesaiModel model, std::vector<HesaiBeam> beams, double max_range_m = 0.0);

  /// Adds a packet; returns the revolution that ends in it, if any.
  Readings add(const Packet& packet);
  /// The present revolution, if at most its last packets are missing.
  std::optional<model::PointSweep> finish();

  const StreamCounts& counts() const { return counts_; }  ///< Counts since the start.
  const SensorClock& clock() const { return clock_; }     ///< The sensor's clock.

 private:
  struct Head;
  struct Firing;
  std::optional<Fault> read_head(std::span<const std::uint8_t> bytes, Head& head) const;
  void add_firing(std::span<const std::uint8_t> bytes, const Head& head, const Firing& firing);
  void start_over();
  void end_turn(std::vector<model::PointSweep>& sweeps);

  HesaiModel model_;
  HesaiFormat format_;
  std::vector<HesaiBeam> beams_;
  double max_range_m_;
  SensorClock clock_;
  SweepBuilder builder_;
  StreamCounts counts_;
  std::vector<std::uint16_t> rings_;  ///< Ring of each beam.
  std::vector<std::size_t> order_;    ///< Beams in order of their rings.
  std::int64_t last_ns_ = 0;          ///< Time of the last packet, sensor's clock.
  int last_azimuth_ = -1;             ///< Azimuth of the last firing [0.01 degrees].
  double azimuth_rate_ = 0.36;        ///< [0.01 degrees per us].
  bool has_begin_ = false;            ///< The present turn began at azimuth 0.
};

}  // namespace understory::packets
