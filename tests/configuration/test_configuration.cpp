// Wrong configuration, generated for every parameter of every real service; and the files that come
// with the project.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "common/bus/launch_config.hpp"
#include "common/bus/memory_bus.hpp"
#include "deploy/cli/services.hpp"
#include "tests/bus/wrong_values.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::cli;
using namespace understory::test;
namespace fs = std::filesystem;

namespace {

/// All parameters of a service, as its process has them.
struct Described {
  bus::RuntimeParameters runtime;
  std::unique_ptr<bus::Adapter> adapter;
  bus::ParameterTable table;
  explicit Described(const bus::Service& service) : adapter(service.make()) {
    describe(runtime, table);
    adapter->describe(table);
  }
};

std::string problem_of(const bus::Service& service, const std::string& key,
                       const std::string& value) {
  Described described(service);
  try {
    described.table.load_text("\n" + key + " = " + value + "\n", "toy.toml");
  } catch (const bus::ConfigurationError& error) {
    return error.what();
  }
  return {};
}

/// The values that are just allowed.
std::vector<std::string> bounds(const bus::ParameterTable::Entry& entry) {
  if (const auto* number = std::get_if<bus::ParameterTable::Number>(&entry.target)) {
    return {fmt::format("{:.17e}", number->range.lowest),
            fmt::format("{:.17e}", number->range.highest)};
  }

  if (const auto* integer = std::get_if<bus::ParameterTable::Integer>(&entry.target)) {
    return {std::to_string(integer->range.lowest), std::to_string(integer->range.highest)};
  }

  if (std::holds_alternative<bus::ParameterTable::Boolean>(entry.target)) return {"true", "false"};
  std::vector<std::string> choices;
  for (const std::string& choice : std::get<bus::ParameterTable::Text>(entry.target).choices) {
    choices.push_back('"' + choice + '"');
  }

  return choices;
}

std::vector<bus::Service> every_service() {
  std::vector<bus::Service> services = all_services();
  for (bus::Service& service : sensor_services()) services.push_back(std::move(service));
  return services;
}

bus::Service service_of(const std::string& name) {
  const auto services = every_service();
  const auto found = std::ranges::find(services, name, &bus::Service::name);
  REQUIRE(found != services.end());
  return *found;
}

}  // namespace

TEST_CASE("every service refuses every wrong value of every parameter", "[configuration]") {
  for (const bus::Service& service : every_service()) {
    const Described described(service);
    CAPTURE(service.name);
    CHECK(described.table.entries().size() > 10);
    for (const bus::ParameterTable::Entry& entry : described.table.entries()) {
      check_every_wrong_value(entry, [&](const std::string& key, const std::string& value) {
        return problem_of(service, key, value);
      });
    }
  }
}

TEST_CASE("a key of an older version is refused with the new one in the message",
          "[configuration]") {
  struct Renamed {
    std::string service;
    std::string old_key;
    std::string value;
    std::string new_name;  ///< As the message shows it.
  };
  const std::vector<Renamed> all = {
      // A key by itself, and one that was renamed together with its table.
      {"associator", "max_turn_rad", "0.1", "max_rotation_rad"},
      {"lidar_imu_input", "lidar.turn_s", "0.1", "lidar.revolution_s"},
      {"lidar_imu_input", "output.max_piece_s", "0.1", "output.max_increment_s"},
      {"keyframer", "joint.min_sightings", "2", "joint.min_observations"},
      {"ekf", "sighting.lasting_m", "1.0", "observation.correlation_m"},
      {"ekf", "motion.standing_sigma_mps", "0.1", "motion.stationary_sigma_mps"},
      {"geoslam_mapper", "ours.lasting_share", "0.5", "smoothing.correlated_share"},
      // A key of a renamed table that kept its own name.
      {"geoslam_mapper", "ours.gate_sigmas", "3.0", "smoothing.gate_sigmas"},
  };

  for (const Renamed& one : all) {
    CAPTURE(one.service, one.old_key, one.value);
    const std::string problem = problem_of(service_of(one.service), one.old_key, one.value);
    CHECK_THAT(problem, Catch::Matchers::StartsWith("toy.toml:2: " + one.old_key + ": "));
    CHECK_THAT(problem, Catch::Matchers::EndsWith("is now called " + one.new_name));
  }
}

TEST_CASE("a key that was removed is refused with what does its work now", "[configuration]") {
  for (const std::string service : {"geoslam_mapper", "keyframer"}) {
    for (const std::string key :
         {"method", "baseline.descriptor_step", "source.min_associations"}) {
      CAPTURE(service, key);
      const std::string problem = problem_of(service_of(service), key, "\"baseline\"");
      CHECK_THAT(problem, Catch::Matchers::StartsWith("toy.toml:2: " + key + ": was removed: "));
      CHECK_THAT(problem, Catch::Matchers::EndsWith("runs in understory eval alone"));
    }
  }
}

TEST_CASE("every new name of a renamed key is a key", "[configuration]") {
  for (const bus::Service& service : every_service()) {
    const Described described(service);
    CAPTURE(service.name);
    const auto& entries = described.table.entries();
    for (const bus::ParameterTable::OldKey& rule : described.table.old_keys()) {
      CAPTURE(rule.name, rule.new_name, rule.why_removed);
      if (rule.new_name.empty()) {
        CHECK_FALSE(rule.why_removed.empty());
        continue;
      }
      const auto is_there = [&](const bus::ParameterTable::Entry& entry) {
        return rule.new_name.ends_with('.') ? entry.key.starts_with(rule.new_name)
                                            : entry.key == rule.new_name;
      };
      CHECK(std::ranges::any_of(entries, is_there));
    }
  }
}

TEST_CASE("the bounds of every parameter are allowed, and so is its default", "[configuration]") {
  for (const bus::Service& service : every_service()) {
    Described described(service);
    CAPTURE(service.name);
    for (const bus::ParameterTable::Entry& entry : described.table.entries()) {
      for (const std::string& value : bounds(entry)) {
        CAPTURE(entry.key, value);
        CHECK(problem_of(service, entry.key, value).empty());
      }
    }
    const std::string printed = described.table.to_toml();
    CHECK_NOTHROW(described.table.load_text(printed, "printed.toml"));
    CHECK(described.table.to_toml() == printed);
  }
}

TEST_CASE("every choice of a parameter that help names starts its service", "[configuration]") {
  std::size_t choices = 0;
  for (const bus::Service& service : every_service()) {
    const Described described(service);
    for (const bus::ParameterTable::Entry& entry : described.table.entries()) {
      const auto* text = std::get_if<bus::ParameterTable::Text>(&entry.target);
      if (text == nullptr) continue;
      for (const std::string& choice : text->choices) {
        CAPTURE(service.name, entry.key, choice);
        bus::MemoryBus bus;
        const std::string toml = entry.key + " = \"" + choice + "\"\n";
        std::string refused;
        try {
          const bus::HostedService hosted(service, bus, bus::no_clock(), toml, "toy.toml");
        } catch (const bus::ConfigurationError& error) {
          refused = error.what();
        }
        // Some need a file beside the choice; its key is named.
        CHECK_THAT(refused, !Catch::Matchers::Contains(entry.key));
        ++choices;
      }
    }
  }
  CHECK(choices > 20);
}

TEST_CASE("every service binds the channels that it declares", "[configuration]") {
  for (const bus::Service& service : every_service()) {
    CAPTURE(service.name);
    if (service.name == "ouster_driver") continue;  // Needs a file: tests/lidar_driver hosts it.
    bus::MemoryBus bus;
    bus::HostedService hosted(service, bus, bus::no_clock(), "", "toy.toml");
    CHECK(service.channels.difference(hosted.node().channels()).empty());
    CHECK(hosted.node().channels().size() >= 1);
  }
}

TEST_CASE("the configurations that come with the project start services that there are",
          "[configuration]") {
  std::size_t directories = 0;
  for (const auto& entry : fs::recursive_directory_iterator(UNDERSTORY_SOURCE_CONFIG)) {
    if (entry.path().filename() != "launch.toml") continue;
    ++directories;
    for (const auto& process : bus::read_launch_config(entry.path().parent_path()).processes) {
      CAPTURE(entry.path(), process.name);
      if (!process.is_service) {
        CHECK(process.executable == "understory");
        continue;
      }
      Described described(service_of(process.name));
      CHECK_NOTHROW(described.table.load(process.config));
      std::string dashed = process.name;
      std::ranges::replace(dashed, '_', '-');
      CHECK(process.executable == "understory-" + dashed);
    }
  }

  CHECK(directories >= 2);
}

TEST_CASE("the mapper of a car with a one-plane laser uses odometry", "[configuration]") {
  Described described(service_of("geoslam_mapper"));
  described.table.load(fs::path(UNDERSTORY_SOURCE_CONFIG) / "planar/geoslam_mapper.toml");
  const auto& entries = described.table.entries();
  const auto use =
      std::ranges::find(entries, "smoothing.use_odometry", &bus::ParameterTable::Entry::key);
  REQUIRE(use != entries.end());
  CHECK(value_as_toml(*use) == "true");
}
