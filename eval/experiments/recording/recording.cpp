// `understory eval recording`: a recorded drive through the whole chain, against the reference that
// the log carries.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/io/lcm_log.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/progress.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/frontend/frontend.hpp"
#include "eval/harness/chain_drive.hpp"
#include "eval/harness/results.hpp"
#include "eval/metrics/victoria_park_score.hpp"
#include "understory/ground_truth_t.hpp"

namespace understory::eval::experiments::recording {
namespace {

struct Options {
  std::string log;
  std::string name;
  std::string config_dir = "deploy/config/lidar";
  std::string json;
  std::vector<double> antenna_m = {0.0, 0.0};  ///< Of GNSS, frame `vehicle`.
  std::vector<double> reference = {0.0, 0.0,
                                   0.0};  ///< x_m, y_m, yaw_rad of what GROUND_TRUTH is of.
  bool plots = true;
};

struct Recording {
  harness::ChainRun run;
  std::vector<model::GnssFix> fixes;
  /// Every `stride`-th sweep as it went to the extractor, with the detections in it, for pictures.
  std::vector<model::PointSweep> sweeps;
  std::vector<model::LandmarkScan> landmarks;
};

void watch_pictures(harness::SensorChain& chain, Recording& recording) {
  auto assembler = std::make_shared<model::SweepAssembler>();
  auto wanted = std::make_shared<std::optional<model::Utime>>();
  chain.watch<model::PointSweep>("LIDAR_SWEEP",
                                 [&recording, assembler, wanted](const model::PointSweep& part) {
                                   constexpr std::uint64_t kStride = 50;
                                   auto whole = assembler->add(part);
                                   if (!whole || whole->revolution % kStride != 5) return;
                                   *wanted = whole->utime;
                                   recording.sweeps.push_back(std::move(*whole));
                                 });
  chain.watch<model::LandmarkScan>("LANDMARKS",
                                   [&recording, wanted](const model::LandmarkScan& scan) {
                                     if (*wanted == scan.utime) recording.landmarks.push_back(scan);
                                   });
}

/// Rows of a chain that heard nothing would look like those of a drive on which nothing was found.
void refuse_unfed(const Options& options, const std::map<std::string, bool>& taken) {
  if (std::ranges::any_of(taken, [](const auto& channel) { return channel.second; })) return;
  std::string channels;
  for (const auto& [channel, is_taken] : taken) channels += " " + channel;
  throw io::LogError(fmt::format("{}: no channel of it is an input of the stages of {}; it has{}",
                                 options.log, options.config_dir, channels));
}

Recording drive_recording(const Options& options, const std::atomic<bool>& stop) {
  Recording recording;
  harness::SensorChain chain(harness::services_of(options.config_dir), options.config_dir);
  watch_chain(chain, recording.run);
  watch_pictures(chain, recording);

  io::LcmLogReader reader(options.log);
  terminal::Progress progress(options.name, static_cast<double>(reader.size_bytes()),
                              terminal::Progress::Without::kSeconds);

  const geometry::SE2 reference_T_vehicle =
      geometry::SE2(options.reference[0], options.reference[1], options.reference[2]).inverse();
  std::uint64_t position = 0;
  std::optional<model::Utime> begin;
  std::map<std::string, bool> taken;  ///< By channel of the log: whether the chain takes it.
  while (const auto event = reader.next()) {
    if (stop) throw std::runtime_error("interrupted");
    begin = begin.value_or(event->utime);
    recording.run.simulated_s = 1e-6 * static_cast<double>(event->utime - *begin);

    if (event->channel == "GROUND_TRUTH") {
      if (const auto truth = wire::decode_message<ground_truth_t>(event->data)) {
        recording.run.truth.push_back(
            {truth->utime, wire::from_wire(truth->world_T_vehicle) * reference_T_vehicle});
      }
    } else if (event->channel == "RAW_GNSS") {
      if (const auto fix = wire::decode_message<model::GnssFix>(event->data))
        recording.fixes.push_back(*fix);
    }

    const auto known = taken.try_emplace(event->channel, chain.takes(event->channel)).first;
    if (known->second) chain.feed(event->channel, event->data);
    progress.advance(reader.position_bytes() - position);
    position = reader.position_bytes();
  }

  reader.refuse_other_files();
  refuse_unfed(options, taken);
  finish_chain(chain, recording.run);
  recording.run.sweeps = recording.run.detections.size();
  return recording;
}

void add_gnss_rows(const Recording& recording, const Eigen::Vector2d& antenna_m,
                   frontend::FrontendRows& rows) {
  const auto add = [&](const std::string& name, const std::vector<metrics::StampedPose>& poses) {
    if (poses.size() < 2) return;
    const metrics::FixErrors errors = against_fixes(poses, recording.fixes, antenna_m);
    if (errors.to_path_m.empty()) return;
    rows.state(name + ": GNSS fix to path, median", errors.to_path_median_m, "m");
    rows.state(name + ": GNSS fix to path, 90 %", errors.to_path_p90_m, "m");
    rows.state(name + ": GNSS fix at its time, median", errors.at_time_median_m, "m");
  };
  add("SLAM_POSE", harness::poses_of(recording.run.slam));
  if (!recording.run.coasting.empty())
    add("SLAM_POSE, COASTING included", harness::poses_of(harness::live_poses(recording.run)));
  add("EKF_POSE", harness::poses_of(recording.run.ekf));
  add("RAW_POSE", recording.run.dead_reckoned);
  add("ODOMETRY summed", recording.run.odometry);
}

double mean_detections(const harness::ChainRun& run) {
  std::size_t sum = 0;
  for (const std::size_t count : run.detections) sum += count;
  return run.detections.empty()
             ? 0.0
             : static_cast<double>(sum) / static_cast<double>(run.detections.size());
}

/// Why SLAM_POSE has no figures; empty where it has.
std::string why_no_pose(const harness::ChainRun& run) {
  if (run.slam.size() >= 2) return {};
  if (run.updates.empty())
    return "SLAM_POSE: no figures, since no KEYFRAME came: see the keyframer below";

  const auto placed = std::ranges::count_if(run.updates, metrics::localised);
  const std::string reason = run.updates.back().reason;
  return fmt::format(
      "SLAM_POSE: no figures, since {} of {} poses are localised: {} are COASTING (by odometry "
      "alone, too few landmarks match). {} of {} keyframes have a place in the map{}{}",
      run.slam.size(), run.slam.size() + run.slam_unsure, run.coasting.size(), placed,
      run.updates.size(), reason.empty() ? "" : "; the last one: ", reason);
}

nlohmann::json pictures_of(const Recording& recording) {
  nlohmann::json pictures = nlohmann::json::array();
  for (const model::LandmarkScan& scan : recording.landmarks) {
    for (const model::PointSweep& sweep : recording.sweeps) {
      if (sweep.utime != scan.utime) continue;

      nlohmann::json points = nlohmann::json::array();
      const Eigen::Quaternionf level =
          sweep.attitude.value_or(model::Attitude{}).level_Q_vehicle.cast<float>();
      const std::size_t stride = 1 + sweep.points.size() / 40000;
      for (std::size_t i = 0; i < sweep.points.size(); i += stride) {
        const Eigen::Vector3f p = level * sweep.points[i].position();
        points.push_back({p.x(), p.y(), p.z()});
      }

      nlohmann::json detections = nlohmann::json::array();
      for (const model::Detection& detection : scan.detections) {
        detections.push_back({detection.position_m.x(), detection.position_m.y(),
                              detection.radius_m, static_cast<int>(detection.kind)});
      }

      pictures.push_back({{"utime", scan.utime}, {"points", points}, {"detections", detections}});
    }
  }
  return pictures;
}

void run(Options options) {
  const auto& stop = terminal::catch_interrupts();
  if (options.name.empty()) options.name = std::filesystem::path(options.log).stem().string();
  const Recording recording = drive_recording(options, stop);

  // The table.
  frontend::FrontendRows rows;
  rows.in(fmt::format("recording {}: {:.1f} s, {} sweeps", options.name, recording.run.simulated_s,
                      recording.run.sweeps));
  rows.state("landmarks in a sweep", mean_detections(recording.run), "");
  rows.state("landmarks in the map", static_cast<double>(recording.run.landmarks.size()), "");
  if (!recording.run.truth.empty()) {
    add_chain_rows(recording.run, {}, rows);
  } else {
    rows.state("SLAM_POSE localised", static_cast<double>(recording.run.slam.size()), "");
    rows.state("SLAM_POSE COASTING", static_cast<double>(recording.run.coasting.size()), "");
    add_time_rows(recording.run, rows);
  }
  if (!recording.fixes.empty()) {
    add_gnss_rows(recording, {options.antenna_m[0], options.antenna_m[1]}, rows);
  }

  std::cout << to_table(rows.rows());
  if (const std::string why = why_no_pose(recording.run); !why.empty()) std::cout << why << '\n';
  for (const auto& [service, health] : recording.run.health) {
    for (const reason_count_t& reason : health.reasons) {
      std::cout << fmt::format("  {}: {} {} {}\n", service, reason.channel, reason.reason,
                               reason.count);
    }
  }

  if (options.json.empty()) return;

  // The documents, with what the plots draw.
  nlohmann::json trace = frontend::trace_of(recording.run);
  nlohmann::json fixes = nlohmann::json::array();
  for (const model::GnssFix& fix : recording.fixes) {
    fixes.push_back(
        {1e-6 * static_cast<double>(fix.utime), fix.east_north_m.x(), fix.east_north_m.y()});
  }
  trace["fixes"] = fixes;
  trace["pictures"] = pictures_of(recording);

  harness::write_json(
      options.json,
      harness::result_document("recording", {{"recording", options.name}}, to_json(rows.rows())));
  harness::write_json(harness::traces_file(options.json), {{options.name, trace}});
  if (options.plots)
    harness::plot("frontend.py", {options.json, harness::traces_file(options.json).string()});
}

}  // namespace

void add_recording_experiment(CLI::App& eval) {
  auto* command = eval.add_subcommand(
      "recording",
      "A recorded drive (any log of `understory import`) through the chain of a configuration");
  auto options = std::make_shared<Options>();
  command->add_option("log", options->log, "Log with the channels that the chain of --config takes")
      ->required();
  command->add_option("--name", options->name, "Name in tables and pictures; default: the file's");
  command->add_option("--config", options->config_dir, "Configuration of the chain's services");
  command->add_option("--json", options->json, "Results; traces and plots go beside it");
  command
      ->add_option("--antenna", options->antenna_m,
                   "x,y [m] of the GNSS antenna on the vehicle (default 0,0)")
      ->delimiter(',')
      ->expected(2);
  command
      ->add_option("--reference", options->reference,
                   "x,y,yaw [m, rad] on the vehicle of the frame of GROUND_TRUTH, if that is not "
                   "the vehicle's")
      ->delimiter(',')
      ->expected(3);
  command->add_flag("!--no-plots", options->plots, "No plots");
  command->callback([options] { run_guarded("recording", [options] { run(*options); }); });
}

}  // namespace understory::eval::experiments::recording
