// `understory map close`: a loop closed in a stored map by a person.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include "common/terminal/interrupt.hpp"
#include "common/terminal/progress.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/loop_end.hpp"
#include "deploy/cli/map_closing.hpp"
#include "deploy/cli/map_commands.hpp"
#include "deploy/cli/said_pose.hpp"
#include "deploy/cli/text_file.hpp"

namespace understory::cli {
namespace {

constexpr double kInDegrees = 180.0 / std::numbers::pi;

struct MapCloseOptions {
  std::string file;
  std::string from;
  std::string to;
  std::uint32_t map_id = 0;
  SaidPose pose;
  bool force = false;
  bool dry_run = false;
  bool json = false;
};

SaidClosure said_by(const MapCloseOptions& options) {
  SaidClosure said{loop_end_of("--from", options.from), loop_end_of("--to", options.to),
                   options.from, options.to, std::nullopt};
  if (options.pose.is_given()) said.from_T_to = options.pose.pose();
  return said;
}

std::string lies_at(const geometry::SE2& pose) {
  return fmt::format("{:.3f}, {:.3f} m, {:.2f} deg", pose.x(), pose.y(), pose.theta() * kInDegrees);
}

/// As a change of the file, unless its maps are no longer those that were read.
std::uint64_t write_closure(const MapCloseOptions& options, const MapToClose& read,
                            const MadeClosure& made) {
  const map_file::ChangeNote note = note_now(
      "understory map close", fmt::format("{} and {}", options.from, options.to),
      fmt::format("map {}: {} lies at {} of {}; moved by up to {:.3f} m and {:.2f} deg",
                  made.map.map_id, options.to, lies_at(made.closure.from_T_to.mean), options.from,
                  made.shifts.landmark_m, made.shifts.heading_rad * kInDegrees));
  map_file::MapFile file(options.file, map_file::Access::kWrite);
  const bool is_same =
      std::ranges::equal(file.maps(), read.known, {}, &map_file::MapSummary::checksum,
                         &map_file::MapSummary::checksum);
  if (!is_same) fail(fmt::format("{}: was changed while a loop was closed", options.file));
  terminal::throw_if_interrupted();
  return file.put(made.map, made.placement(read), note);
}

void print_closure(const MapCloseOptions& options, const MapToClose& read, const MadeClosure& made,
                   std::uint64_t change) {
  if (made.found) {
    const map_merge::Alignment& alignment = made.found->alignment;
    fmt::print("{} landmarks in both, {:.0f} % of those there; expected by chance: 10^{:.0f}\n",
               alignment.pairs.size(), 100.0 * alignment.share(), alignment.log10_false_alarm);
  }
  fmt::print("{} lies at {} of {}, where the map had {}\n", options.to,
             lies_at(made.closure.from_T_to.mean), options.from, lies_at(made.before));
  fmt::print(
      "chi2 of the closure: {:.1f} before, {:.1f} after (3 degrees of freedom); of all else "
      "after: {:.1f}\n",
      made.expected.chi2, made.closed.closure_chi2, made.closed.graph_chi2);
  fmt::print("moved: {} of {} parts, by up to {:.3f} m and {:.2f} deg\n", made.shifts.parts,
             read.graph.parts.size(), made.shifts.landmark_m, made.shifts.heading_rad * kInDegrees);
  fmt::print(
      "in the map twice, it seems: {} pairs of landmarks within {} m ({} before); both stay\n",
      made.doubles, kCoincident_m, made.doubles_before);
  fmt::print("{}\n", change == 0 ? "nothing was written (--dry-run)"
                                 : fmt::format("-> {} (change {})", options.file, change));
}

nlohmann::ordered_json pose_json(const geometry::SE2& pose) {
  return {{"x_m", pose.x()}, {"y_m", pose.y()}, {"theta_deg", pose.theta() * kInDegrees}};
}

nlohmann::ordered_json closure_json(const MapCloseOptions& options, const MapToClose& read,
                                    const MadeClosure& made, std::uint64_t change) {
  nlohmann::ordered_json found;
  if (made.found) {
    found = {{"pairs", made.found->alignment.pairs.size()},
             {"share", made.found->alignment.share()},
             {"log10_false_alarm", made.found->alignment.log10_false_alarm},
             {"reach_m", made.found->reach_m}};
  }
  const map_closure::PartGraph& graph = read.graph;
  return {{"file", options.file},
          {"map_id", made.map.map_id},
          {"from", options.from},
          {"to", options.to},
          {"pose", pose_json(made.closure.from_T_to.mean)},
          {"pose_before", pose_json(made.before)},
          {"found", found},
          {"chi2_before", made.expected.chi2},
          {"chi2_after", made.closed.closure_chi2},
          {"chi2_of_the_rest", made.closed.graph_chi2},
          {"moved_m", made.shifts.landmark_m},
          {"moved_deg", made.shifts.heading_rad * kInDegrees},
          {"moved_parts", made.shifts.parts},
          {"parts", graph.parts.size()},
          {"motions", graph.motions},
          {"shared_landmarks", graph.shared},
          {"assumed_motions", graph.assumed},
          {"doubles_before", made.doubles_before},
          {"doubles", made.doubles},
          {"change", change == 0 ? nlohmann::ordered_json() : nlohmann::ordered_json(change)}};
}

MadeClosure make_with_progress(const MapCloseOptions& options, const MapToClose& read,
                               const SaidClosure& said) {
  terminal::Progress progress("looking for the same landmarks", 1.0);
  return make_closure(read, said, options.force, [&](double part) {
    terminal::throw_if_interrupted();
    progress.update(part);
  });
}

void print_result(const MapCloseOptions& options, const MapToClose& read, const MadeClosure& made,
                  std::uint64_t change) {
  if (options.json) {
    fmt::print("{}\n", result_text(closure_json(options, read, made, change), 2));
  } else {
    print_closure(options, read, made, change);
  }
}

void run_map_close(const MapCloseOptions& options) {
  terminal::catch_interrupts();
  const SaidClosure said = said_by(options);

  try {
    const MapToClose read = read_map_to_close(options.file, options.map_id);
    const MadeClosure made = make_with_progress(options, read, said);
    const std::uint64_t change = options.dry_run ? 0 : write_closure(options, read, made);
    print_result(options, read, made, change);
  } catch (const map_closure::ClosureError& error) {
    fail(fmt::format("{}: {}", options.file, error.what()));
  }
}

}  // namespace

void add_map_close(CLI::App& map) {
  auto* command =
      map.add_subcommand("close",
                         "Closes a loop between two submaps of a drive's map; without a pose it "
                         "finds one from the landmarks of both. `map revert` undoes it");
  const auto options = std::make_shared<MapCloseOptions>();
  command->add_option("file", options->file, "A map file that submap_store wrote")->required();
  command->add_option("--from", options->from, "One end: submap:N, or keyframe:N by its sequence")
      ->required();
  command->add_option("--to", options->to, "The other end")->required();
  command->add_option("--map", options->map_id, "Number of the map, if several have submaps")
      ->check(CLI::Range(std::uint32_t{1}, map_file::kLastMapId));
  add_said_pose(*command, options->pose, "--to in the frame of --from");
  command->add_flag("--force", options->force,
                    "Close it even if it contradicts the map by more than chance explains");
  command->add_flag("--dry-run", options->dry_run, "Show the result and write nothing");
  command->add_flag("--json", options->json, "As JSON, on standard output");
  command->callback([options] { guarded_map_work([&] { run_map_close(*options); }); });
}

}  // namespace understory::cli
