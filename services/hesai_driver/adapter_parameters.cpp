#include "services/hesai_driver/adapter_parameters.hpp"

namespace understory::hesai_driver {

void describe(HesaiDriverParameters& p, bus::ParameterTable& table) {
  lidar_driver::describe(p.network, table, [&] {
    lidar_driver::describe_port("network.data_port", p.ports.data, table);
  });
  table.add("sensor.model", p.sensor.model,
            {"pandar40p", "pandar64", "pandarqt", "xt16", "xt32", "xt32m2x"},
            "Model of the laser.");
  table.add("sensor.angle_file", p.sensor.angle_file, {},
            "The sensor's own angle correction file (CSV); empty: the model's nominal angles.");
  lidar_driver::describe(p.range, table);
  lidar_driver::describe(p.time, table,
                         "Stamps: the laser's clock (PTP or GPS), or the time of reception.");
}

}  // namespace understory::hesai_driver
