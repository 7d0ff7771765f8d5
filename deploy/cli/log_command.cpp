// `understory log record|info|check|accuracy|repair|cut`: recorded logs.
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <regex>

#include "common/io/lcm_log.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/printable.hpp"
#include "common/terminal/progress.hpp"
#include "deploy/cli/commands.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/guarded_log.hpp"
#include "deploy/cli/log_commands.hpp"
#include "deploy/cli/log_statistics.hpp"
#include "deploy/cli/text_file.hpp"

namespace understory::cli {
namespace {

struct LogContents {
  LogStatistics statistics;
  io::LogDamage damage;
};

/// Reads a whole log with progress; `visit` gets every event.
template <class Visit>
LogContents walk(const std::string& file, const Visit& visit) {
  LogContents contents;
  io::LcmLogReader reader(file);
  terminal::Progress progress("reading " + file, static_cast<double>(reader.size_bytes()));
  terminal::catch_interrupts();
  while (auto event = reader.next()) {
    terminal::throw_if_interrupted();
    contents.statistics.add(*event);
    visit(*event, reader.damage());
    progress.update(static_cast<double>(reader.position_bytes()));
  }
  reader.refuse_other_files();
  contents.damage = reader.damage();
  return contents;
}

void ignore(const io::LogEvent& /*event*/, const io::LogDamage& /*damage*/) {}

nlohmann::ordered_json to_json(const std::string& file, const LogContents& contents) {
  nlohmann::ordered_json json{{"file", file},
                              {"events", contents.statistics.events()},
                              {"duration_s", contents.statistics.duration_s()},
                              {"first_utime", contents.statistics.first_utime()},
                              {"damaged_places", contents.damage.places},
                              {"damaged_bytes", contents.damage.bytes},
                              {"events_lost", contents.damage.events_lost}};
  json["programs"] = nlohmann::ordered_json::array();
  for (const auto& [process, version] : contents.statistics.programs())
    json["programs"].push_back({{"process", process}, {"version", version}});
  for (const auto& [name, channel] : contents.statistics.channels()) {
    json["channels"].push_back({{"channel", name},
                                {"type", channel.type},
                                {"events", channel.events},
                                {"rate_hz", channel.rate_hz()},
                                {"bytes", channel.bytes},
                                {"lost", channel.lost},
                                {"malformed", channel.malformed}});
  }

  return json;
}

/// One line for each version.
void print_programs(const LogStatistics& statistics) {
  std::map<std::string, std::string> by_version;
  for (const auto& [process, version] : statistics.programs()) {
    std::string& names = by_version[version];
    names += (names.empty() ? "" : ", ") + terminal::printable(process);
  }
  for (const auto& [version, names] : by_version)
    fmt::print("version {}: {}\n", terminal::printable(version), names);
}

void print_info(const std::string& file, const LogContents& contents) {
  const auto& statistics = contents.statistics;
  fmt::print("{}: {} events in {:.1f} s", file, statistics.events(), statistics.duration_s());
  if (statistics.events() > 0) {
    fmt::print(", received from {:%Y-%m-%d %H:%M:%S} UTC",
               fmt::gmtime(static_cast<std::time_t>(statistics.first_utime() / 1'000'000)));
  }

  fmt::print("\n{:<32} {:<20} {:>9} {:>9} {:>12} {:>7}\n", "channel", "type", "events", "Hz",
             "bytes", "lost");
  for (const auto& [name, channel] : statistics.channels()) {
    fmt::print("{:<32} {:<20} {:>9} {:>9.2f} {:>12} {:>7}\n", name, channel.type, channel.events,
               channel.rate_hz(), channel.bytes, channel.lost);
  }

  print_programs(statistics);

  if (contents.damage.places > 0) {
    fmt::print("damaged: {} bytes in {} places (details: understory log check)\n",
               contents.damage.bytes, contents.damage.places);
  }
}

void info(const std::string& file, bool json) {
  const auto contents = walk(file, ignore);
  if (json) {
    fmt::print("{}\n", result_text(to_json(file, contents), 2));
  } else {
    print_info(file, contents);
  }
}

/// Prints one line for each fault of one channel; returns the number of lines.
std::size_t print_channel_findings(const std::string& name, const ChannelStatistics& channel) {
  std::size_t findings = 0;
  const auto finding = [&](std::uint64_t count, std::string_view what) {
    if (count == 0) return;
    fmt::print("{}: {} {}\n", name, count, what);
    ++findings;
  };
  finding(channel.malformed,
          "malformed messages, the last one " + terminal::printable(channel.last_malformed));
  finding(channel.lost, "messages missing by their sequence numbers");
  finding(channel.restarts, "times the sequence starts again (its process was restarted)");
  finding(channel.stamps_back, "stamps that go back");
  return findings;
}

void check(const std::string& file) {
  std::size_t findings = 0;
  const auto place = [&](const io::LogDamage& damage) {
    fmt::print("byte {}: {} bytes are no event\n", damage.last_offset, damage.last_bytes);
    ++findings;
  };

  std::uint64_t places = 0;
  const auto contents = walk(file, [&](const io::LogEvent&, const io::LogDamage& damage) {
    if (damage.places != places) place(damage);
    places = damage.places;
  });

  if (contents.damage.places != places) place(contents.damage);
  const auto& statistics = contents.statistics;
  const auto finding = [&](std::uint64_t count, std::string_view what) {
    if (count == 0) return;
    fmt::print("{} {}\n", count, what);
    ++findings;
  };

  finding(statistics.missing_numbers(), "event numbers are missing");
  finding(statistics.clock_back(), "times the receive time goes back");
  finding(statistics.clock_forward(), "times the receive time jumps by more than ten seconds");

  for (const auto& [name, channel] : statistics.channels()) {
    findings += print_channel_findings(name, channel);
  }

  if (findings > 0) fail(fmt::format("{}: {} findings", file, findings));
  fmt::print("{}: {} events on {} channels, nothing wrong\n", file, statistics.events(),
             statistics.channels().size());
}

void repair(const std::string& file, const std::string& out) {
  io::LcmLogWriter writer(out);
  const auto contents = walk(file, [&](const io::LogEvent& event, const io::LogDamage&) {
    writer.write(event.utime, event.channel, event.data);
  });
  if (contents.statistics.events() == 0 && contents.damage.bytes > 0) {
    fail(fmt::format("{}: no event in it that can be saved", file));
  }
  writer.commit();
  fmt::print("{}: {} events kept, {} bytes left out in {} places -> {}\n", file,
             contents.statistics.events(), contents.damage.bytes, contents.damage.places, out);
}

struct Cut {
  double from_s = 0.0;
  double to_s = std::numeric_limits<double>::infinity();
  std::string channels = ".*";
};

void cut(const std::string& file, const std::string& out, const Cut& wanted) {
  std::regex channels;
  try {
    channels = std::regex(wanted.channels);
  } catch (const std::regex_error&) {
    wrong_usage(fmt::format("--channels {}: not a regular expression", wanted.channels));
  }

  if (!(wanted.from_s <= wanted.to_s)) wrong_usage("--from lies behind --to");
  io::LcmLogWriter writer(out);
  std::optional<std::int64_t> start;

  walk(file, [&](const io::LogEvent& event, const io::LogDamage&) {
    if (!start) start = event.utime;
    const double time_s = 1e-6 * (static_cast<double>(event.utime) - static_cast<double>(*start));
    if (time_s < wanted.from_s || time_s > wanted.to_s) return;
    if (std::regex_match(event.channel, channels)) {
      writer.write(event.utime, event.channel, event.data);
    }
  });

  if (writer.events() == 0) fail(fmt::format("{}: nothing in it lies in the cut", file));
  writer.commit();
  fmt::print("{} events -> {}\n", writer.events(), out);
}

struct LogOptions {
  std::string file;
  std::string out;
  bool json = false;
  Cut cut;
  RecordOptions record;
  AccuracyOptions accuracy;
};

}  // namespace

void add_log_command(CLI::App& parent) {
  auto* log = parent.add_subcommand("log", "Logs: recording, gaps, damage, clock jumps");
  log->require_subcommand(1);
  auto options = std::make_shared<LogOptions>();
  const auto add = [&](const char* name, const char* description) {
    auto* command = log->add_subcommand(name, description);
    command->add_option("file", options->file, "An LCM log")->required();
    return command;
  };
  auto* record_command = add("record", "Records the bus until Ctrl-C, as lcm-logger does");
  record_command->add_option("--lcm-url", options->record.lcm_url,
                             "Bus, e.g. udpm://239.255.76.67:7667?ttl=0");
  record_command->add_option("--channels", options->record.channels, "Regular expression");
  record_command->add_flag("--sweeps", options->record.sweeps,
                           "Also record RAW_SWEEP and LIDAR_SWEEP");
  record_command->add_flag("--force", options->record.force, "Overwrite an existing file");
  record_command->callback(
      guarded(options, [](const LogOptions& o) { log_record(o.file, o.record); }));

  auto* info_command = add("info", "Contents of a log");
  info_command->add_flag("--json", options->json, "As JSON");
  info_command->callback(guarded(options, [](const LogOptions& o) { info(o.file, o.json); }));

  add("check", "Faults of a log; exit status 1 if there are any")
      ->callback(guarded(options, [](const LogOptions& o) { check(o.file); }));

  auto* accuracy_command = add("accuracy", "Errors of the run against the ground truth in the log");
  accuracy_command->add_option("--json", options->accuracy.json_file,
                               "Also write it to this file, with series");
  accuracy_command
      ->add_option("--truth-sigma-m", options->accuracy.truth_sigma_m,
                   "Standard deviation of the true positions, per axis; for NEES")
      ->check(CLI::Range(0.0, 100.0));
  accuracy_command
      ->add_option("--truth-sigma-deg", options->accuracy.truth_sigma_deg,
                   "Standard deviation of the true headings; for NEES")
      ->check(CLI::Range(0.0, 90.0));
  accuracy_command->footer(
      "Live poses of SLAM_POSE and keyframes of the final map. ATE: after rigid alignment without\n"
      "scale, as evo_ape --align. RPE: pairs of poses 10, 100 and 1000 m of true path apart, as\n"
      "evo_rpe --delta_unit m --all_pairs --pairs_from_reference; means per metre of path as "
      "KITTI.\n"
      "NEES: pose errors by stated covariances, 3 degrees of freedom. Definitions and keys of the\n"
      "JSON: deploy/cli/accuracy.md.");
  accuracy_command->callback(
      guarded(options, [](const LogOptions& o) { log_accuracy(o.file, o.accuracy); }));

  auto* repair_command = add("repair", "Writes the readable events as a log without damage");
  repair_command->add_option("--out", options->out, "The new log")->required();
  repair_command->callback(guarded(options, [](const LogOptions& o) { repair(o.file, o.out); }));

  auto* cut_command = add("cut", "A part of a log, by receive time and channel");
  cut_command->add_option("--out", options->out, "The new log")->required();
  cut_command->add_option("--from", options->cut.from_s, "[s] from the first event");
  cut_command->add_option("--to", options->cut.to_s, "[s] from the first event");
  cut_command->add_option("--channels", options->cut.channels, "Regular expression");
  cut_command->callback(guarded(options, [](const LogOptions& o) { cut(o.file, o.out, o.cut); }));
}

}  // namespace understory::cli
