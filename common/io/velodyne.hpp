// Packets of Velodyne lasers: VLP-16, VLP-32C, HDL-32E, HDL-64E.
//
// A data packet has 1206 bytes: 12 blocks of (flag, azimuth, 32 x (distance, reflectivity)), a time
// (microseconds past the hour) and two factory bytes (return mode, product). There is one azimuth
// per block; between blocks it is interpolated, and each firing gets its own time from the firing
// sequences of the manuals (VLP-16: 63-9243; VLP-32C: 63-9325; HDL-32E: 63-9113; HDL-64E:
// 63-HDL64ES3). This is an own decoder, because PCL's grabbers need vtk and pcap at build time,
// have no time per point, support neither dual returns of the HDL-64 nor position packets, and run
// a thread.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/model/point_sweep.hpp"

namespace understory::io {

/// The supported models.
enum class VelodyneModel : std::uint8_t { kVlp16, kVlp32c, kHdl32e, kHdl64e };
/// Model by name: "vlp16", "vlp32c", "hdl32e", "hdl64e"; none for any other.
std::optional<VelodyneModel> velodyne_model(std::string_view name);
/// The name for velodyne_model().
std::string_view to_string(VelodyneModel model);

constexpr std::size_t kVelodyneDataBytes = 1206;
constexpr std::size_t kVelodynePositionBytes = 512;
constexpr std::uint16_t kVelodyneDataPort = 2368;
constexpr std::uint16_t kVelodynePositionPort = 8308;

/// One beam: its direction and the corrections of its readings.
struct VelodyneBeam {
  double elevation_rad = 0.0;
  double azimuth_rad = 0.0;  ///< Added to the block's azimuth; clockwise positive.
  double distance_correction_m = 0.0;
  double vertical_offset_m = 0.0;
  double horizontal_offset_m = 0.0;
};

/// The geometry of one sensor: direction of each beam.
struct VelodyneCalibration {
  VelodyneModel model = VelodyneModel::kVlp16;
  std::vector<VelodyneBeam> beams;   ///< In order of the laser's own numbers.
  std::vector<std::uint16_t> rings;  ///< Ring of each beam, 0 = lowest elevation.
  double distance_step_m = 0.002;    ///< Distance of one count.
};

/// Built in for VLP-16, VLP-32C and HDL-32E. Throws DataError for the HDL-64E: each sensor has its
/// own calibration file.
VelodyneCalibration velodyne_calibration(VelodyneModel model);
/// Parses the HDL-64E's calibration file: the XML (boost archive) from Velodyne, or its YAML form
/// (`lasers:` with rot_correction and so on). Throws DataError.
VelodyneCalibration parse_hdl64_calibration(std::string_view text, std::string_view source);

/// Fault of bytes that are no data packet of the model.
enum class VelodynePacketFault : std::uint8_t {
  kWrongSize,
  kOtherModel,  ///< Another model's product code or flags.
  kDamaged,     ///< Impossible flags or azimuths.
};
/// Fault of the bytes as a data packet of the model; none = valid.
std::optional<VelodynePacketFault> check_velodyne_packet(std::span<const std::uint8_t> packet,
                                                         VelodyneModel model);
/// Time of sending [us past the hour, sensor's clock]. Precondition: its size is right.
std::uint32_t velodyne_packet_time_us(std::span<const std::uint8_t> packet);

/// Counts of a decoder so far.
struct VelodyneCounts {
  std::uint64_t packets = 0;
  std::uint64_t refused = 0;       ///< Wrong size, flag, azimuth or product.
  std::uint64_t turns = 0;         ///< Complete revolutions.
  std::uint64_t lost_azimuth = 0;  ///< Gaps in the azimuth: packets are missing.
};

/// Input: data packets; output: complete revolutions in frame sensor (x forward = azimuth 0, y
/// left, z up). Dual returns give two points, unless they are equal.
class VelodyneDecoder {
 public:
  /// Points at `max_range_m` and beyond are left out; 0 = the model's own range (VLP-32C: 200 m,
  /// others 120 m).
  explicit VelodyneDecoder(VelodyneCalibration calibration, double max_range_m = 0.0);

  /// Adds a packet; returns the revolution that it completes, if any. `received`: reception time
  /// [us]; it determines the hour of the packet's own time (the nearest).
  std::optional<model::PointSweep> add(std::span<const std::uint8_t> packet, model::Utime received);
  /// The present revolution, if at most its last packet is missing.
  std::optional<model::PointSweep> finish();
  /// The packets and revolutions so far.
  const VelodyneCounts& counts() const { return counts_; }

 private:
  struct Block;
  struct Reading {
    std::size_t beam;
    double azimuth;  ///< Azimuth of the firing [0.01 degrees].
    std::uint16_t distance;
    std::uint8_t intensity;
    double utime;
  };
  std::optional<model::PointSweep> take_revolution();
  void add_block(std::span<const std::uint8_t> packet, const Block& block);
  void add_point(model::PointSweep& sweep, const Reading& reading);

  VelodyneCalibration calibration_;
  double max_range_m_;
  VelodyneCounts counts_;
  std::array<float, 36000> sine_{};
  std::array<float, 36000> cosine_{};
  std::vector<std::size_t> order_;  ///< Beams in order of their rings.
  model::PointSweep sweep_;         ///< The present revolution.
  model::PointSweep
      pending_;  ///< Begin of the next revolution, from the packet that ends this one.
  bool revolution_started_ = false;  ///< The present revolution began at azimuth 0.
  int last_azimuth_ = -1;
  double azimuth_rate_ = 0.2;  ///< Hundredths of a degree per microsecond.
  std::uint64_t revolutions_ = 0;
};

/// The NMEA sentence of a position packet: position and time by GNSS.
struct VelodynePosition {
  std::uint32_t past_hour_us = 0;
  bool is_valid = false;
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double speed_mps = 0.0;
  double course_rad = 0.0;  ///< Course from north, clockwise.
  std::int64_t day_us = 0;  ///< Time of day, UTC [us].
};
/// The position packet's sentence; none where the size is wrong or there is no valid $GPRMC.
std::optional<VelodynePosition> parse_velodyne_position(std::span<const std::uint8_t> packet);
/// A $GPRMC sentence; none where the checksum is wrong or a field is missing. past_hour_us stays 0.
std::optional<VelodynePosition> parse_gprmc(std::string_view sentence);

}  // namespace understory::io
