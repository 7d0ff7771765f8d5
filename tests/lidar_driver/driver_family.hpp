// A made-up laser of each maker, the driver that listens to it, and what an import gives of it.
#pragma once

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "services/hesai_driver/adapter.hpp"
#include "services/livox_driver/adapter.hpp"
#include "services/ouster_driver/adapter.hpp"
#include "services/velodyne_driver/adapter.hpp"
#include "tests/io/log_fixture.hpp"
#include "tests/lidar_driver/live_driver.hpp"
#include "tests/packets/made_up_sensor.hpp"

namespace understory::test {

inline model::Utime wall_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

/// A maker's laser and its driver.
struct Family {
  MadeUpSensor sensor;
  bus::Service service;
  std::vector<std::string> port_keys;
  std::string sensor_toml;
  std::vector<std::uint16_t> ports;  ///< Of the recording, in the order of `port_keys`.

  /// Keys behind network.bind_address, with these ports; 0 = any free one.
  std::string toml(std::vector<int> listened = {}) const {
    listened.resize(port_keys.size(), 0);
    std::string text;
    for (std::size_t i = 0; i < port_keys.size(); ++i)
      text += fmt::format("{} = {}\n", port_keys[i], listened[i]);
    return text + sensor_toml;
  }
};

struct DriverFixture {
  TemporaryDirectory directory;

  std::string file_of(const MadeUpSensor& sensor) {
    const auto file = directory / (std::to_string(files_++) + sensor.description.source);
    std::ofstream(file) << sensor.description.description;
    return file.string();
  }
  Family family(const MadeUpSensor& sensor) {
    const std::string& model = sensor.description.model;
    const std::string of_model = "[sensor]\nmodel = \"" + model + "\"\n";
    if (model == "vlp16")
      return {sensor,
              velodyne_driver::velodyne_driver_service(),
              {"data_port", "position_port"},
              of_model,
              {2368, 8308}};
    if (model == "ouster")
      return {sensor,
              ouster_driver::ouster_driver_service(),
              {"lidar_port", "imu_port"},
              "[sensor]\nmetadata_file = \"" + file_of(sensor) + "\"\n",
              {7502, 7503}};
    if (const auto livox = packets::livox_model(model)) {
      const packets::LivoxPorts ports = livox_ports(*livox);
      return {sensor,
              livox_driver::livox_driver_service(),
              {"points_port", "imu_port"},
              of_model,
              {ports.points, ports.imu}};
    }
    const std::string& angles = sensor.description.description;
    return {sensor,
            hesai_driver::hesai_driver_service(),
            {"data_port"},
            of_model + (angles.empty() ? "" : "angle_file = \"" + file_of(sensor) + "\"\n"),
            {2368}};
  }
  /// Lasers that speak Livox's SDK1 have no driver.
  std::vector<Family> families(const std::vector<MadeUpSensor>& sensors) {
    std::vector<Family> all;
    for (const MadeUpSensor& sensor : sensors) {
      const auto livox = packets::livox_model(sensor.description.model);
      if (!livox || !packets::speaks_sdk1(*livox)) all.push_back(family(sensor));
    }
    return all;
  }

 private:
  int files_ = 0;
};

/// What the import of a capture of these packets writes.
struct Offline {
  std::vector<Message> sweeps;
  std::vector<Message> imu;
};

inline Offline import(const MadeUpSensor& sensor, const std::vector<SentPacket>& packets) {
  packets::Decoder decoder = make_decoder(sensor.description);
  Offline offline;
  const auto write = [&](const model::PointSweep& sweep) {
    for (model::PointSweep& part : split_sweep(sweep, 4000)) {
      part.sequence = offline.sweeps.size();
      offline.sweeps.push_back(wire::encode_message(part));
    }
  };
  for (const SentPacket& packet : packets) {
    const packets::Readings readings = add(decoder, {packet.bytes, packet.sent});
    for (const auto& sweep : readings.sweeps) write(sweep);
    for (const auto& sample : readings.imu) offline.imu.push_back(wire::encode_message(sample));
  }
  if (const auto sweep = finish(decoder)) write(*sweep);
  return offline;
}

}  // namespace understory::test
