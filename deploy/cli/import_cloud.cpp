#include "deploy/cli/import_cloud.hpp"

#include <map>
#include <string>

namespace understory::cli {

void add_cloud_options(CLI::App& command, bag::CloudOptions& cloud) {
  static const std::map<std::string, double> kUnits_s{
      {"s", 1.0}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}};
  command
      .add_option_function<std::string>(
          "--point-time",
          [&cloud](const std::string& unit) { cloud.time_unit_s = kUnits_s.at(unit); },
          "Unit of the points' times: s, ms, us or ns")
      ->check(CLI::IsMember(kUnits_s));
  command
      .add_option("--max-range", cloud.max_range_m,
                  "Range of the 3-D laser; points more than 1 % beyond are left out [m]")
      ->check(CLI::Range(1.0, 1000.0))
      ->capture_default_str();
}

}  // namespace understory::cli
