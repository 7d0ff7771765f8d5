#include "eval/experiments/existence/census/census_run.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <string>
#include <utility>

#include "common/bus/config_layers.hpp"
#include "common/bus/launch_config.hpp"
#include "common/wire/convert.hpp"
#include "eval/experiments/existence/census/census_drive.hpp"
#include "eval/experiments/existence/census/landmark_stems.hpp"
#include "eval/harness/drive_map.hpp"
#include "eval/harness/input_log.hpp"
#include "sim/hash_random.hpp"

namespace understory::eval::experiments::existence::census {
namespace {

constexpr double kDayOfCensus_s = 86400.0;
constexpr double kBetweenCensuses_s = 6.0 * 365.25 * kDayOfCensus_s;
constexpr const char* kMapper = "geoslam_mapper";
constexpr const char* kTracker = "existence_tracker";

std::vector<bus::Service> services_from_landmarks(const std::filesystem::path& config_dir) {
  std::vector<bus::Service> services = harness::services_of(config_dir);
  const std::set<std::string> wanted{"keyframer", kMapper, kTracker};
  std::erase_if(services, [&](const bus::Service& one) { return !wanted.contains(one.name); });
  return services;
}

/// Parameter files of the processes that begin with the map (none where the path is empty).
std::map<std::string, std::string> census_parameters(const CensusOptions& options,
                                                     const std::filesystem::path& map) {
  toml::table mapper;
  toml::table tracker{{"model", toml::table{{"decay_per_s", options.decay_per_s},
                                            {"decay_weight", options.decay_weight}}},
                      {"looks", toml::table{{"use_ranges", options.use_ranges}}},
                      // All that changes is told, so that the order of the probabilities is seen.
                      {"output", toml::table{{"told_change", 0.0}}}};
  if (!map.empty())
    for (toml::table* const one : {&mapper, &tracker})
      one->insert("input", toml::table{{"map_file", map.string()}});
  return {{kMapper, bus::layer_over(bus::config_file_in(options.config_dir, kMapper), mapper)},
          {kTracker, bus::layer_over(bus::config_file_in(options.config_dir, kTracker), tracker)}};
}

/// One drive through the processes.
harness::ChainRun drive_processes(CensusDrive& drive, const CensusOptions& options,
                                  const std::filesystem::path& map,
                                  const std::filesystem::path& log,
                                  const std::vector<geometry::SE2>& path, LandmarkStems& names,
                                  const std::function<void(double)>& progress) {
  harness::InputLog recorder(log);
  harness::ChainRun run;
  harness::SensorChain chain(services_from_landmarks(options.config_dir), options.config_dir,
                             census_parameters(options, map));
  harness::watch_chain(chain, run);
  names.begin_drive();
  for (std::size_t i = 0; const auto scan = drive.next(options.forest.range_m); ++i) {
    const model::Utime utime = scan->landmarks.utime;
    const auto feed = [&](const char* channel, const wire::Bytes& bytes) {
      recorder.add(utime, channel, bytes);
      chain.feed(channel, bytes);
    };
    names.add(utime, scan->stems);
    run.truth.push_back({utime, path[i]});
    recorder.add_truth(utime, path[i]);
    if (scan->odometry) feed("ODOMETRY", wire::encode_message(*scan->odometry));
    if (options.use_ranges) feed("VIEW_RANGES", wire::encode_message(scan->view));
    feed("LANDMARKS", wire::encode_message(scan->landmarks));
    if (i % 1000 == 0) progress(static_cast<double>(i) / static_cast<double>(path.size()));
  }
  harness::finish_chain(chain, run);
  recorder.finish();
  for (const model::MapUpdate& update : run.updates) names.count(update);
  return run;
}

/// What the map has of each stem.
struct StemEntry {
  double probability = 0.0;
  std::size_t in_use = 0;  ///< Landmarks.
};
std::map<std::uint32_t, StemEntry> stems_of(const harness::ChainRun& run,
                                            const LandmarkStems& names) {
  std::map<std::uint32_t, StemEntry> entries;
  for (const model::MapLandmark& landmark : run.landmarks) {
    const auto stem = names.of(landmark.id);
    if (!stem) continue;
    const auto told = run.existence.find(landmark.id);
    StemEntry& entry = entries[*stem];
    const bool is_told = told != run.existence.end();
    entry.probability = std::max(entry.probability, is_told ? told->second.probability : 1.0);
    entry.in_use += !is_told || told->second.is_in_use ? 1 : 0;
  }
  return entries;
}

CensusAfterDrive after_drive(const harness::ChainRun& run, const LandmarkStems& names,
                             const std::vector<CensusStem>& stems, bool is_later,
                             const std::vector<std::uint32_t>& mapped) {
  CensusAfterDrive after;
  after.landmarks = run.landmarks.size();
  after.updates = run.updates.size();
  for (const model::MapUpdate& update : run.updates)
    after.placed += metrics::localised(update) ? 1 : 0;
  after.maps = harness::count_maps(run.slam);
  after.ate_m = harness::trajectory_error(run.slam, run.truth).ate_rms_m;

  std::map<std::uint32_t, StemEntry> entries = stems_of(run, names);
  for (const auto& [stem, entry] : entries) {
    after.in_use += entry.in_use;
    if (entry.in_use == 0) continue;
    after.doubles_in_use += entry.in_use - 1;
    after.recruits_in_use += stems[stem].is_new && stems[stem].stands(is_later) ? 1 : 0;
    after.ghosts_in_use += stems[stem].stands(is_later) ? 0 : 1;
  }
  for (const std::uint32_t stem : mapped) {
    const StemEntry& entry = entries[stem];
    after.stems.push_back({stem, entry.probability, entry.in_use > 0});
  }
  return after;
}

/// Each case of a call has its own.
std::string case_name(const CensusOptions& options, std::uint64_t seed) {
  return fmt::format("{}-missed-{:.0f}-{}-{}-seed-{}",
                     options.forest.is_changed ? "change" : "control",
                     100.0 * options.forest.pass_missed, options.use_ranges ? "ranges" : "blind",
                     options.share_errors ? "shared" : "independent", seed);
}

History history_of(const std::vector<CensusStem>& stems, const ForestSetting& setting) {
  History history;
  history.mapping_drives = 1;
  history.pass_recall = 1.0 - setting.pass_missed;
  history.false_rate = setting.false_rate;
  std::size_t before = 0, gone = 0;
  for (const CensusStem& stem : stems) {
    history.points_m.emplace_back(stem.place_m.x(), stem.place_m.y(), 1.0F);
    before += stem.is_new ? 0 : 1;
    gone += stem.is_gone && setting.is_changed ? 1 : 0;
  }
  history.gone_share = static_cast<double>(gone) / static_cast<double>(before);
  return history;
}

}  // namespace

CensusRun run_census(const std::vector<CensusStem>& stems, const CensusOptions& options,
                     std::uint64_t seed, const std::filesystem::path& scratch,
                     const std::function<void(double)>& progress) {
  const ForestSetting& setting = options.forest;
  std::mt19937_64 random(seed);
  const StemGrid grid(stems, setting.range_m);
  CensusRun result{history_of(stems, setting), {}};
  LandmarkStems names;
  std::vector<std::uint32_t> mapped;
  std::filesystem::path map;
  for (int k = 0; k <= setting.drives; ++k) {
    const bool is_later = k > 0 && setting.is_changed;
    const double time_s =
        (is_later ? kBetweenCensuses_s : 0.0) + kDayOfCensus_s * static_cast<double>(k);
    ForestDrive looks(stems, grid, setting, is_later, random);
    const double shift_m =
        std::uniform_real_distribution<double>(0.0, 0.5 * setting.lane_m)(random);
    const std::vector<geometry::SE2> path = lanes_there_and_back(stems, setting, shift_m);
    CensusDrive drive(looks, path, static_cast<model::Utime>(1e6 * (1.0 + time_s)),
                      census_errors(options.share_errors), seed,
                      sim::mixed(seed, static_cast<std::uint64_t>(k)), random);
    const auto kept = [&](const char* ending) {
      return options.logs.empty()
                 ? std::filesystem::path()
                 : options.logs / fmt::format("{}-drive-{}{}", case_name(options, seed), k, ending);
    };
    harness::ChainRun run =
        drive_processes(drive, options, map, kept(".lcm"), path, names,
                        [&](double done) { progress((k + done) / (setting.drives + 1)); });

    if (k == 0) {
      std::set<std::uint32_t> seen;
      for (const model::MapLandmark& landmark : run.landmarks)
        if (const auto stem = names.of(landmark.id); stem && !stems[*stem].is_new)
          seen.insert(*stem);
      mapped.assign(seen.begin(), seen.end());
    }
    result.after.push_back(after_drive(run, names, stems, is_later, mapped));
    result.history.drives.push_back(looks.finish(time_s));
    if (!options.state_covariances)
      for (model::MapLandmark& landmark : run.landmarks) landmark.covariance_m2.setZero();
    map = scratch / ("drive-" + std::to_string(k) + ".gpkg");
    harness::write_drive_map(run, "census", map);
    if (!options.logs.empty())
      std::filesystem::copy_file(map, kept(".gpkg"),
                                 std::filesystem::copy_options::overwrite_existing);
  }
  return result;
}

}  // namespace understory::eval::experiments::existence::census
