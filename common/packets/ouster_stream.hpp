// Packets of Ouster lasers: OS-0, OS-1, OS-2, OSDome.
//
// Layouts from the Ouster firmware user manual ("Lidar Data Packet Format", "IMU Data Packet
// Format") and ouster-sdk (`ouster_client/src/parsing.cpp`, `xyzlut.cpp`). A lidar packet has
// `columns_per_packet` columns; all beams of a column fire at its timestamp, and a column has a
// flag of validity. Frames are distinguished by their number, not by angles.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/packets/ouster_metadata.hpp"
#include "common/packets/readings.hpp"
#include "common/packets/sensor_clock.hpp"
#include "common/packets/sweep_builder.hpp"

namespace understory::packets {

constexpr std::size_t kOusterImuBytes = 48;
constexpr std::uint16_t kOusterLidarPort = 7502;
constexpr std::uint16_t kOusterImuPort = 7503;

/// Layout of a lidar packet [bytes].
struct OusterFormat {
  std::size_t packet_header = 0;
  std::size_t column_header = 0;
  std::size_t pixel = 0;  ///< Bytes of one beam.
  std::size_t column = 0;
  std::size_t packet = 0;
};
/// Format of a sensor's packets with these metadata.
OusterFormat ouster_format(const OusterProfile& profile, std::size_t beams,
                           std::size_t columns_per_packet);
/// Whether these bytes are an IMU packet of profile ACCEL32_GYRO32_NMEA (firmware 3.2 and later): a
/// header of 32 bytes, 100 of NMEA, samples of 36 each, a footer of 32.
bool is_ouster_imu_block(std::span<const std::uint8_t> bytes);

/// Input: lidar and IMU packets; output: frames and IMU samples in the sensor's frame (x away from
/// the connector, z up). Dual returns give two points, unless they are equal.
class OusterStream {
 public:
  /// Points at `max_range_m` and beyond are left out; 0 = the product line's range.
  explicit OusterStream(OusterMetadata metadata, double max_range_m = 0.0);

  /// Adds a packet; returns an IMU sample, or the frame that it ends.
  Readings add(const Packet& packet);
  /// The present frame, if it reaches the end of the azimuth window.
  std::optional<model::PointSweep> finish();

  const StreamCounts& counts() const { return counts_; }  ///< Counts since the start.
  const SensorClock& clock() const { return clock_; }     ///< The sensor's clock.
  const OusterMetadata& metadata() const {
    return metadata_;
  }  ///< The metadata given to the constructor.
  /// Position of the IMU in the sensor's frame.
  std::optional<Eigen::Vector3d> imu_position_m() const {
    return metadata_.sensor_T_imu.translation();
  }

 private:
  struct Column;
  std::optional<Fault> check(std::span<const std::uint8_t> bytes) const;
  Column column_at(std::span<const std::uint8_t> bytes, std::size_t number) const;
  std::uint32_t frame_id(std::span<const std::uint8_t> bytes) const;
  void add_lidar(const Packet& packet, Readings& readings);
  struct ImuReading;
  void add_imu_packet(const Packet& packet, Readings& readings);
  void add_imu_block(const Packet& packet, Readings& readings);
  void add_sample(const ImuReading& reading, model::Utime received, Readings& readings);
  void add_column(std::span<const std::uint8_t> bytes, const Column& column);
  void take_time(std::int64_t time_ns, model::Utime received);
  bool is_of_fewer_columns() const;
  void end_frame(std::vector<model::PointSweep>& sweeps);
  std::size_t from_window(std::size_t column) const;

  OusterMetadata metadata_;
  OusterFormat format_;
  double max_range_m_;
  SensorClock clock_;
  SweepBuilder builder_;
  StreamCounts counts_;
  std::vector<std::uint16_t> rings_;         ///< Ring of each beam.
  std::vector<std::size_t> order_;           ///< Beams in order of their rings.
  std::vector<Eigen::Vector3d> directions_;  ///< Direction of each beam at encoder angle 0.
  std::optional<std::uint32_t> frame_id_;
  std::size_t next_column_ = 0;  ///< Next expected column, counted from the window's begin.
  bool has_begin_ = false;       ///< The present frame has its first columns.
  bool has_gap_ = false;         ///< Columns are missing within the present frame.
  /// Successive frames that ended after a half or a quarter of the columns without a gap: the
  /// sensor has fewer columns than its metadata.
  int short_frames_ = 0;
  std::uint64_t imu_samples_ = 0;
};

}  // namespace understory::packets
