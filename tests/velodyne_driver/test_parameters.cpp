// Parameters that cannot work.
#include "common/bus/parameter_table.hpp"
#include "tests/velodyne_driver/live_velodyne.hpp"

using namespace understory;
using namespace understory::velodyne_driver;

namespace {

std::string configured(const std::string& toml) {
  bus::MemoryBus bus;
  try {
    const bus::HostedService hosted(velodyne_driver_service(), bus, bus::no_clock(), toml,
                                    "test.toml");
  } catch (const bus::ConfigurationError& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("configurations that cannot work are refused by key", "[velodyne_driver]") {
  CHECK(configured("").empty());
  CHECK(configured("[sensor]\nmodel = \"hdl64e\"\n").starts_with("sensor.calibration_file"));
  CHECK(configured("[sensor]\nmodel = \"hdl64e\"\ncalibration_file = \"/no/such.xml\"\n")
            .starts_with("sensor.calibration_file: "));
  CHECK(configured("[sensor]\ncalibration_file = \"a.xml\"\n")
            .starts_with("sensor.calibration_file"));
  CHECK(configured("[network]\nbind_address = \"localhost\"\n")
            .starts_with("network.bind_address: \"localhost\""));
  CHECK(configured("[network]\nsensor_address = \"1.2.3\"\n")
            .starts_with("network.sensor_address: \"1.2.3\""));
}
