// Lasers that are made up: their packets, and the points and samples that these were made from.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "common/model/imu.hpp"
#include "common/packets/decoder.hpp"

namespace understory::test {

/// A return as it was before it was put into a packet.
struct TruePoint {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< Frame `sensor`, after quantisation of
                                                         ///< the range.
  std::int64_t time_ns = 0;                              ///< Since 1970.
  std::uint16_t ring = 0;
  std::uint8_t intensity = 0;
};

/// A packet on its way.
struct SentPacket {
  std::vector<std::uint8_t> bytes;
  model::Utime sent = 0;   ///< When it left the sensor [us].
  std::uint16_t port = 0;  ///< UDP, destination.
};

/// What a sensor sent while it made whole sweeps.
struct MadeUpRecording {
  std::vector<SentPacket> packets;
  std::vector<std::vector<TruePoint>> sweeps;  ///< Those that are whole.
  std::vector<model::ImuSample> imu;
};

/// One model in one mode.
struct MadeUpSensor {
  std::string name;
  packets::SensorDescription description;
  double tolerance_m = 1e-3;  ///< Of float32, and of tables of angles.
  /// `sweeps` whole ones behind the begin of one; starts at `start` [us].
  std::function<MadeUpRecording(int sweeps, model::Utime start, std::mt19937_64& random)> record;
};

/// Every family, model, profile and number of returns.
std::vector<MadeUpSensor> made_up_ousters();
std::vector<MadeUpSensor> made_up_livoxes();
std::vector<MadeUpSensor> made_up_hesais();
std::vector<MadeUpSensor> made_up_velodynes();
/// All of them.
std::vector<MadeUpSensor> made_up_sensors();
/// One of each family.
std::vector<MadeUpSensor> one_of_each_family();

/// An Ouster's metadata. `is_nested`: the layout of firmware 2.4 and later, else the flat one.
std::string ouster_json(const packets::OusterMetadata& metadata, bool is_nested);
/// Metadata of random geometry.
packets::OusterMetadata random_ouster(const std::string& profile, std::size_t beams,
                                      std::size_t columns, std::mt19937_64& random);

}  // namespace understory::test
