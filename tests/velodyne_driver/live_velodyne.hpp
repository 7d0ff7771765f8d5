// The Velodyne driver with sockets on loopback, and its decoder without.
#pragma once

#include "common/io/velodyne.hpp"
#include "services/velodyne_driver/adapter.hpp"
#include "tests/lidar_driver/live_driver.hpp"

namespace understory::test {

/// On two ports of its own.
class LiveVelodyne : public LiveDriver {
 public:
  explicit LiveVelodyne(const std::string& toml = "")
      : LiveDriver(velodyne_driver::velodyne_driver_service(),
                   "data_port = 0\nposition_port = 0\n" + toml) {
    REQUIRE(ports.size() == 2);
    data_port = ports[0];
    position_port = ports[1];
  }

  int data_port = 0;
  int position_port = 0;
};

/// What the import of a capture would have written: decoder and parts, without driver.
class OfflineDriver {
 public:
  explicit OfflineDriver(io::VelodyneCalibration calibration) : decoder_(std::move(calibration)) {}

  void add(std::span<const std::uint8_t> packet, model::Utime received) {
    if (const auto turn = decoder_.add(packet, received)) write(*turn);
  }
  void finish() {
    if (const auto turn = decoder_.finish()) write(*turn);
  }
  std::vector<Message> parts;

 private:
  void write(const model::PointSweep& turn) {
    for (model::PointSweep& part : split_sweep(turn, 4000)) {
      part.sequence = parts.size();
      parts.push_back(wire::encode_message(part));
    }
  }
  io::VelodyneDecoder decoder_;
};

}  // namespace understory::test
