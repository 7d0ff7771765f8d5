#include "deploy/cli/import_packets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "common/io/data_error.hpp"
#include "common/packets/decoder.hpp"
#include "common/packets/survey.hpp"
#include "common/terminal/interrupt.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/guarded_import.hpp"
#include "deploy/cli/import_tables.hpp"
#include "deploy/cli/recording_log.hpp"

namespace understory::cli {
namespace {

namespace fs = std::filesystem;

/// So many packets tell which sensors there are: a Velodyne's sentences come once a second.
constexpr std::uint64_t kSurveyedPackets = 20'000;

struct PacketImportOptions {
  std::string path;
  std::string out;
  std::string model;   ///< Empty = the one that the packets look like.
  std::string file;    ///< Metadata, calibration or angles.
  std::string sensor;  ///< IPv4 address; empty = the only one.
  double period_s = 0.1;
  double max_range_m = 0.0;
  SensorTables tables;  ///< They take the place of the laser's own samples and fixes.
  bool list = false;
};

/// Which packets are decoded, and how.
struct PacketSource {
  std::uint32_t sender = 0;
  std::set<std::uint16_t> ports;
  std::string model;
};

/// An Ouster's and a Velodyne's second flow may have no packet yet that tells what it is.
bool belongs_to(const packets::Flow& flow, const std::string& model) {
  if (flow.recognised.kind != packets::Kind::kUnknown) return true;
  if (model == "ouster") return flow.sizes.contains(packets::kOusterImuBytes);
  return io::velodyne_model(model) && flow.sizes.contains(io::kVelodynePositionBytes);
}

/// Senders of point packets.
std::vector<packets::Flow> point_flows(const packets::Survey& survey,
                                       const PacketImportOptions& options) {
  std::vector<packets::Flow> found;
  for (const packets::Flow& flow : survey.flows) {
    if (!options.sensor.empty() && packets::address_text(flow.sender) != options.sensor) continue;
    const bool is_known = flow.recognised.kind == packets::Kind::kPoints &&
                          !(flow.recognised.model.empty() && options.model.empty());
    if (is_known) found.push_back(flow);
  }
  return found;
}

[[noreturn]] void fail_unknown(const PacketImportOptions& options, const std::string& what) {
  fail(fmt::format("{}: {}; it holds:\n{}", options.path, what,
                   survey_text(packets::survey_capture(options.path))));
}

PacketSource choose_source(const PacketImportOptions& options) {
  packets::Survey survey = packets::survey_capture(options.path, kSurveyedPackets);
  std::vector<packets::Flow> flows = point_flows(survey, options);
  if (flows.empty() && !survey.is_whole_file) {
    survey = packets::survey_capture(options.path);
    flows = point_flows(survey, options);
  }
  if (flows.empty())
    fail_unknown(options,
                 options.sensor.empty()
                     ? "no point packets of a laser that is known"
                     : "no point packets of a known laser from --sensor " + options.sensor);
  const auto is_of_another = [&](const packets::Flow& flow) {
    return flow.sender != flows.front().sender || flow.port != flows.front().port;
  };
  if (std::ranges::any_of(flows, is_of_another))
    fail_unknown(options, options.sensor.empty()
                              ? "point packets of several lasers: choose one by --sensor ADDRESS"
                              : "point packets to several ports");

  PacketSource source{flows.front().sender, {}, options.model};
  if (source.model.empty()) source.model = flows.front().recognised.model;
  for (const packets::Flow& flow : survey.flows) {
    if (flow.sender == source.sender && belongs_to(flow, source.model))
      source.ports.insert(flow.port);
  }
  return source;
}

/// Recorders of Ouster's put the metadata beside the capture, under the same name.
std::string sensor_file(const PacketImportOptions& options, const std::string& model) {
  if (!options.file.empty()) return options.file;
  const fs::path beside = fs::path(options.path).replace_extension(".json");
  if (model == "ouster" && fs::is_regular_file(beside)) return beside.string();
  return {};
}

packets::Decoder decoder_of(const PacketImportOptions& options, const std::string& model) {
  const std::string file = sensor_file(options, model);
  if (file.empty() && model == "ouster")
    fail(
        fmt::format("{}: packets of an Ouster laser do not say where its beams point: give its "
                    "metadata by --metadata FILE.json",
                    options.path));
  return packets::make_decoder({model, file.empty() ? std::string() : read_recorded(file), file,
                                options.max_range_m, options.period_s});
}

void write_readings(const packets::Readings& readings, const SensorTables& tables,
                    RecordingLog& log) {
  if (tables.gnss.empty()) {
    for (const model::GnssFix& fix : readings.fixes) log.add("RAW_GNSS", fix);
  }
  if (tables.imu.empty()) {
    for (const model::ImuSample& sample : readings.imu) log.add("RAW_IMU", sample);
  }
  for (const model::PointSweep& sweep : readings.sweeps) log.add_sweep("RAW_SWEEP", sweep);
}

/// Which clock the stamps are of.
std::string clock_text(const packets::Decoder& decoder) {
  const packets::SensorClock* clock = packets::clock(decoder);
  if (clock == nullptr) return "the sensor's clock, in the hour of the capture";
  if (clock->moved_ns() != 0)
    return fmt::format(
        "the sensor's clock does not show the time of day; moved by {:.6f} s onto the capture's",
        1e-9 * static_cast<double>(clock->moved_ns()));
  return fmt::format("the sensor's clock, {:.3f} s behind the capture's at the end",
                     1e-6 * static_cast<double>(clock->lag_us().value_or(0)));
}

void report(const PacketImportOptions& options, const PacketSource& source,
            const packets::Decoder& decoder, const io::PacketCapture& capture,
            const RecordingLog& log) {
  const packets::StreamCounts& counts = packets::counts(decoder);
  fmt::print(
      "{} at {}: {} sweeps of {} packets ({} refused, {} gaps), {} IMU samples, {} wheel "
      "samples, {} fixes{} "
      "-> {}\n",
      source.model, packets::address_text(source.sender), counts.sweeps, counts.packets,
      counts.refused, counts.gaps, log.count("RAW_IMU"), log.count("RAW_WHEELS"),
      log.count("RAW_GNSS"), capture.is_cut_off() ? ", the file is cut off" : "", options.out);
  if (capture.counts().incomplete > 0)
    fmt::print("{} UDP packets lack fragments and are left out\n", capture.counts().incomplete);
  fmt::print("stamps: {}\n", clock_text(decoder));
  const auto imu_m = packets::imu_position_m(decoder);
  if (imu_m && options.tables.imu.empty() && log.count("RAW_IMU") > 0)
    fmt::print("IMU in the laser's frame, along its axes: x {:.4f} y {:.4f} z {:.4f} m\n",
               imu_m->x(), imu_m->y(), imu_m->z());
}

void import_capture(const PacketImportOptions& options) {
  const PacketSource source = choose_source(options);
  packets::Decoder decoder = decoder_of(options, source.model);
  io::PacketCapture capture(options.path);
  RecordingLog log(options.out);
  add_tables(options.tables, log);

  while (const auto packet = capture.next()) {
    terminal::throw_if_interrupted();
    if (packet->sender != source.sender || !source.ports.contains(packet->port)) continue;
    write_readings(add(decoder, {packet->payload, packet->utime}), options.tables, log);
  }
  if (auto sweep = finish(decoder)) log.add_sweep("RAW_SWEEP", *sweep);

  const packets::StreamCounts& counts = packets::counts(decoder);
  if (counts.sweeps == 0)
    fail(fmt::format("{}: {} {} packets, {} refused: not one whole sweep{}", options.path,
                     counts.packets, source.model, counts.refused,
                     counts.refused > 0 ? "; do model and metadata fit the packets?" : ""));
  log.require_common_time();
  log.commit();
  report(options, source, decoder, capture, log);
}

void list_capture(const PacketImportOptions& options) {
  const packets::Survey survey = packets::survey_capture(options.path);
  fmt::print("{}{:.3f} s\n", survey_text(survey), survey.duration_s);
}

void run_packet_import(const PacketImportOptions& options) {
  if (!options.list && options.out.empty()) wrong_usage("import pcap: --out or --list is wanted");
  if (!options.list) refuse_to_overwrite(options.path, options.out);
  guarded_import([&] { options.list ? list_capture(options) : import_capture(options); });
}

}  // namespace

void add_packet_import(CLI::App& import) {
  auto* command = import.add_subcommand(
      "pcap", "Captured packets of a laser: Velodyne, Ouster, Livox, Hesai (pcap, pcapng)");
  const auto options = std::make_shared<PacketImportOptions>();
  command->add_option("path", options->path, "A pcap or pcapng file")->required();
  command->add_option("--out", options->out, "The log to write");
  command->add_flag("--list", options->list, "Show senders, ports and makers; write nothing");
  command->add_option(
      "--model", options->model,
      "Laser of the packets; default: as found from them. One of " + packets::known_models());
  command->add_option(
      "--metadata,--calibration", options->file,
      "Ouster's metadata (JSON; default: FILE.json beside FILE.pcap), the HDL-64E's "
      "XML or YAML file, Hesai's angle correction file (CSV)");
  command->add_option("--sensor", options->sensor,
                      "IPv4 address of the laser, if the capture has several");
  command
      ->add_option("--period", options->period_s,
                   "Duration of a sweep [s] of a Livox laser, whose pattern does not repeat")
      ->check(CLI::Range(0.01, 10.0));
  command
      ->add_option("--max-range", options->max_range_m,
                   "Leave out points farther than this [m]; default: the model's range")
      ->check(CLI::Range(0.0, 1000.0));
  add_table_options(*command, options->tables);
  command->callback([options] { run_packet_import(*options); });
}

}  // namespace understory::cli
