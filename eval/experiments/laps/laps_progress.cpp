// An interrupted run of eval laps goes on where it was.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/io/output_file.hpp"
#include "common/io/text_file.hpp"
#include "eval/experiments/laps/laps.hpp"
#include "eval/tools/machine.hpp"

namespace understory::eval::experiments::laps {
namespace {

using nlohmann::json;

json::binary_t binary(std::string_view bytes) {
  return json::binary_t(std::vector<std::uint8_t>(bytes.begin(), bytes.end()));
}

std::string text(const json& value) {
  const json::binary_t& bytes = value.get_binary();
  return {bytes.begin(), bytes.end()};
}

json to_json(const std::vector<Lap>& laps) {
  json rows = json::array();
  for (const Lap& l : laps) {
    rows.push_back({l.number, l.hours, l.heap_mib, l.mapper_state_mib, l.mapper_p99_ms,
                    l.mapper_largest_ms, l.ate_m, l.mean_nees, l.largest_nees, l.poses, l.unsure,
                    l.keyframes, l.refused});
  }
  return rows;
}

std::vector<Lap> laps_of(const json& rows) {
  std::vector<Lap> laps;
  for (const json& r : rows) {
    laps.push_back({r.at(0), r.at(1), r.at(2), r.at(3), r.at(4), r.at(5), r.at(6), r.at(7), r.at(8),
                    r.at(9), r.at(10), r.at(11), r.at(12)});
  }
  return laps;
}

/// What must be the same for a run to go on. The hours may be more.
std::string run_of(const LapsOptions& options) {
  return fmt::format(
      "version {}, seed {}, {} laps of {} m, {} beams, {}, known ground {} m, in '{}'",
      tools::version(), options.seed, options.laps, options.length_m, options.beams,
      options.config_dir.string(), options.known_ground_m, options.localise_in.string());
}

}  // namespace

void store_progress(const LapsOptions& options, const Progress& progress) {
  if (options.progress.empty()) return;
  json states = json::object();
  for (const auto& [name, state] : progress.states) states[name] = binary(state);
  json messages = json::array();
  for (const harness::RawMessage& message : progress.recorded.messages)
    messages.push_back({message.utime, message.channel, json(json::binary_t(message.bytes))});
  json first = json::array();
  if (progress.map_T_world)
    first = {progress.map_T_world->x(), progress.map_T_world->y(), progress.map_T_world->theta()};

  const json all = {{"run", run_of(options)},
                    {"laps", to_json(progress.laps)},
                    {"stretches", to_json(progress.stretches)},
                    {"states", states},
                    {"messages", messages},
                    {"map_T_world", first},
                    {"readings", progress.readings},
                    {"sweep_parts", progress.sweep_parts},
                    {"driven_m", progress.driven_m}};
  const std::vector<std::uint8_t> bytes = json::to_cbor(all);
  io::write_whole_file(options.progress,
                       {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

Progress load_progress(const LapsOptions& options) {
  Progress progress;
  if (options.progress.empty() || !std::filesystem::exists(options.progress)) return progress;
  const std::string bytes = io::read_whole_file(options.progress);
  const json all = json::from_cbor(bytes, true, false);
  if (all.is_discarded() || !all.contains("run"))
    throw std::runtime_error(options.progress.string() + ": no progress of eval laps");
  if (all.at("run") != run_of(options)) {
    throw std::runtime_error(fmt::format("{}: of another run ({}); this one is {}",
                                         options.progress.string(),
                                         all.at("run").get<std::string>(), run_of(options)));
  }

  progress.laps = laps_of(all.at("laps"));
  progress.stretches = laps_of(all.at("stretches"));
  for (const auto& [name, state] : all.at("states").items()) progress.states[name] = text(state);
  for (const json& one : all.at("messages")) {
    const json::binary_t& content = one.at(2).get_binary();
    progress.recorded.messages.push_back(
        {one.at(0), one.at(1), wire::Bytes(content.begin(), content.end())});
  }
  const json& first = all.at("map_T_world");
  if (!first.empty()) progress.map_T_world = geometry::SE2(first.at(0), first.at(1), first.at(2));
  progress.readings = all.at("readings");
  progress.sweep_parts = all.at("sweep_parts");
  progress.driven_m = all.at("driven_m");
  return progress;
}

}  // namespace understory::eval::experiments::laps
