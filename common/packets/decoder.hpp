// One interface for the lasers of all makers: input: packets; output: sweeps, IMU samples and
// fixes.
//
// A family is a class with `Readings add(const Packet&)`, `std::optional<model::PointSweep>
// finish()` and `const StreamCounts& counts() const`; another family is another alternative here.
#pragma once

#include <concepts>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "common/packets/hesai_stream.hpp"
#include "common/packets/livox_stream.hpp"
#include "common/packets/ouster_stream.hpp"
#include "common/packets/velodyne_stream.hpp"

namespace understory::packets {

/// Requirements on a family's class.
template <class Family>
concept PacketStream = requires(Family& stream, const Family& seen, const Packet& packet) {
  { stream.add(packet) } -> std::same_as<Readings>;
  { stream.finish() } -> std::same_as<std::optional<model::PointSweep>>;
  { seen.counts() } -> std::same_as<const StreamCounts&>;
};

static_assert(PacketStream<VelodyneStream> && PacketStream<OusterStream> &&
              PacketStream<LivoxStream> && PacketStream<HesaiStream>);

/// A laser of any of the families.
using Decoder = std::variant<VelodyneStream, OusterStream, LivoxStream, HesaiStream>;

/// Adds a packet; returns its readings.
Readings add(Decoder& decoder, const Packet& packet);
/// The present sweep, if it is almost complete.
std::optional<model::PointSweep> finish(Decoder& decoder);
/// Counts since the start.
const StreamCounts& counts(const Decoder& decoder);
/// Relation of the sensor's clock to the computer's; null for Velodyne, which sends only
/// microseconds of the hour.
const SensorClock* clock(const Decoder& decoder);

/// Position of the laser's IMU in frame `sensor` [m]; none without an IMU or where it is not
/// published.
std::optional<Eigen::Vector3d> imu_position_m(const Decoder& decoder);

/// Description of a sensor beside its packets.
struct SensorDescription {
  std::string model;         ///< A name for the families' *_model(), or "ouster".
  std::string description;   ///< Text of the model's required or optional file: Ouster's metadata,
                             ///< the HDL-64E's calibration, Hesai's angle correction.
  std::string source;        ///< That file's name, for messages.
  double max_range_m = 0.0;  ///< Range; 0 = the model's.
  double livox_period_s = 0.1;  ///< Duration of a sweep of a non-repeating pattern.
};
/// All possible values of SensorDescription::model, comma separated.
std::string known_models();
/// Throws DataError where the model is unknown, a required file is missing, or a file is not
/// allowed.
Decoder make_decoder(const SensorDescription& sensor);

}  // namespace understory::packets
