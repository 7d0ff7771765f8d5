// Bags that a test writes, imported by the command, and what is then in the log.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/wire/convert.hpp"
#include "tests/bag/bag_writer.hpp"
#include "tests/catch.hpp"
#include "tests/cli/run_command.hpp"
#include "tests/cli/simulated_bag.hpp"

namespace understory::test {

inline constexpr std::int64_t kStart_ns = SimulatedBag::kStart_ns;

/// Each channel's messages.
inline std::map<std::string, std::vector<Bytes>> channels_of(const std::filesystem::path& log) {
  std::map<std::string, std::vector<Bytes>> channels;
  io::LcmLogReader reader(log);
  while (auto event = reader.next()) channels[event->channel].push_back(std::move(event->data));
  return channels;
}

/// The sweeps of a log, whole.
inline std::vector<model::PointSweep> sweeps_of(const std::string& log) {
  model::SweepAssembler assembler;
  std::vector<model::PointSweep> sweeps;
  auto channels = channels_of(log);
  for (const Bytes& bytes : channels["RAW_SWEEP"]) {
    const auto part = wire::decode_message<model::PointSweep>(bytes);
    REQUIRE(part);
    if (auto sweep = assembler.add(*part)) sweeps.push_back(*std::move(sweep));
  }
  return sweeps;
}

/// A folder with one bag.
struct BagFolder {
  TemporaryDirectory directory;

  std::string path(const std::string& name) const { return (directory / name).string(); }
  std::string write(const BagForm& form, const std::vector<Recorded>& messages) const {
    write_bag(directory / form.file(), form, messages);
    return path(form.file());
  }
  Outcome import(const std::string& bag, const std::string& more) const {
    return understory_command(directory, "import bag " + bag + " " + more);
  }
  void refused(const std::string& bag, const std::string& more, const std::string& what) const {
    const Outcome outcome = import(bag, more + " --out " + path("refused.lcm"));
    CAPTURE(more, outcome.out, outcome.error);
    CHECK(outcome.status != 0);
    CHECK(lines(outcome.error) == 1);
    CHECK_THAT(outcome.error, Catch::Matchers::Contains(what));
    CHECK_FALSE(std::filesystem::exists(path("refused.lcm")));
  }
};

inline Recorded imu_at(std::int64_t time_ns, std::int64_t stamp_ns,
                       const std::string& topic = "/imu") {
  return {topic, "sensor_msgs/Imu", time_ns,
          imu_message({bag::Encoding::kCdr, false}, {{stamp_ns, "imu"}, {0, 0, 0}, {0, 0, 9.81}})};
}

}  // namespace understory::test
