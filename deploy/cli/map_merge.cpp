// `understory map merge`: merges two overlapping maps.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/map_file/opening.hpp"
#include "common/map_merge/fusion.hpp"
#include "common/reference_system/reference_system.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/progress.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/loop_end.hpp"
#include "deploy/cli/map_commands.hpp"
#include "deploy/cli/said_pose.hpp"
#include "deploy/cli/text_file.hpp"

namespace understory::cli {
namespace {

namespace fs = std::filesystem;
using map_file::MapFile;
using map_file::StoredMap;
using map_merge::Alignment;
using map_merge::MergedMaps;

struct MapMergeOptions {
  fs::path first;
  fs::path second;
  std::uint32_t first_map = 0;  ///< 0 = the only one with landmarks.
  std::uint32_t second_map = 0;
  fs::path into;
  fs::path out;
  double sigma_m = 0.1;
  std::string first_at;  ///< An end of the first map; empty = its frame.
  std::string second_at;
  SaidPose pose;  ///< Pose of second_at in first_at.
  bool force = false;
  bool json = false;

  /// Whether two maps of one file are merged.
  bool is_one_file() const {
    std::error_code ignored;
    return fs::equivalent(first, second, ignored);
  }
};

/// The maps to merge, as read. The files are not locked during the search for the overlap.
struct MapsToMerge {
  StoredMap first;
  StoredMap second;
  std::uint32_t second_id = 0;  ///< Number in its file.
  geometry::SE2 first_T_at;     ///< See MapMergeOptions::first_at.
  geometry::SE2 second_T_at;
  std::vector<map_file::MapSummary> known;  ///< All maps of the first one's file.
  std::optional<model::MapReference> first_reference;
  std::optional<model::MapReference> second_reference;
};

/// Largest difference between the georeferences of two files.
constexpr double kSamePlace_m = 0.5;

Eigen::Vector2d middle_of(const StoredMap& map) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const map_file::StoredLandmark& one : map.landmarks) sum += one.landmark.position_m;
  return map.landmarks.empty() ? sum : sum / static_cast<double>(map.landmarks.size());
}

/// The requested map, or the only one with landmarks.
StoredMap chosen_of(const MapFile& file, std::uint32_t map_id, const char* option) {
  if (map_id != 0) return file.read(map_id);
  std::vector<std::uint32_t> with_landmarks;
  for (const map_file::MapSummary& map : file.maps())
    if (map.trunks + map.corners > 0) with_landmarks.push_back(map.map_id);
  if (with_landmarks.size() != 1)
    fail(fmt::format("{}: {} maps with landmarks are in it: say which one by {}",
                     file.file().string(), with_landmarks.size(), option));
  return file.read(with_landmarks.front());
}

/// In one file the second map keeps its number; in another file the number may be in use.
std::uint32_t number_for_second(const MapMergeOptions& options,
                                const std::vector<map_file::MapSummary>& known,
                                std::uint32_t map_id) {
  if (options.is_one_file()) return map_id;
  if (std::ranges::find(known, map_id, &map_file::MapSummary::map_id) == known.end()) return map_id;
  const std::uint32_t next = known.back().map_id + 1;
  if (next > map_file::kLastMapId)
    fail(fmt::format("{}: no number is left for a map", options.first.string()));
  return next;
}

/// Pose of an end in its map; identity where no end is given.
geometry::SE2 end_in(const MapFile& file, const StoredMap& map, const char* option,
                     const std::string& text) {
  if (text.empty()) return {};
  const model::LoopEnd end = loop_end_of(option, text);
  if (end.submap != 0) {
    for (const model::Submap& one : file.submaps(map.map_id))
      if (one.id == end.submap) return one.map_T_submap;
  } else {
    for (const model::KeyframePose& one : map.keyframes)
      if (one.keyframe_sequence == end.keyframe) return one.map_T_vehicle;
  }
  fail(fmt::format("{}: {} {}: map {} has none", file.file().string(), option, text, map.map_id));
}

MapsToMerge read_maps_to_merge(const MapMergeOptions& options) {
  const MapFile file(options.first, map_file::Access::kRead);
  std::optional<MapFile> other;
  if (!options.is_one_file()) other.emplace(options.second, map_file::Access::kRead);

  MapsToMerge maps;
  maps.known = file.maps();
  maps.first_reference = file.reference();
  maps.second_reference = other ? other->reference() : maps.first_reference;
  maps.first = chosen_of(file, options.first_map, "--first-map");
  maps.second = chosen_of(other ? *other : file, options.second_map, "--second-map");
  maps.second_id = maps.second.map_id;
  if (!other && maps.first.map_id == maps.second_id)
    wrong_usage("map merge: both are one map; --first-map and --second-map say which ones");
  maps.first_T_at = end_in(file, maps.first, "--first-at", options.first_at);
  maps.second_T_at = end_in(other ? *other : file, maps.second, "--second-at", options.second_at);
  maps.second.map_id = number_for_second(options, maps.known, maps.second_id);
  return maps;
}

/// Standard deviations of x, y [m] and heading [rad], along the first frame's axes.
Eigen::Vector3d sigmas_of(const Alignment& alignment) {
  const Eigen::Matrix2d rotation = alignment.first_T_second.rotation();
  const Eigen::Matrix2d place =
      rotation * alignment.covariance.topLeftCorner<2, 2>() * rotation.transpose();
  return Eigen::Vector3d(place(0, 0), place(1, 1), alignment.covariance(2, 2)).cwiseSqrt();
}

/// Share of suspected doubles among all landmarks of the merged map.
double doubled_pct(const MergedMaps& merged) {
  const std::size_t all = std::max<std::size_t>(1, merged.map.landmarks.size());
  return 100.0 * static_cast<double>(merged.suspected_doubles) / static_cast<double>(all);
}

std::string offset_text(const Alignment& alignment) {
  const geometry::SE2& motion = alignment.first_T_second;
  const Eigen::Vector3d sigma = sigmas_of(alignment);
  return fmt::format("{:.3f}, {:.3f} m, {:.5f} rad (sigma {:.3f}, {:.3f} m, {:.5f} rad)",
                     motion.x(), motion.y(), motion.theta(), sigma.x(), sigma.y(), sigma.z());
}

void print_merge(const Alignment& alignment, const MergedMaps& merged, const std::string& where) {
  fmt::print("offset of the second frame in the first: {}\n", offset_text(alignment));
  fmt::print(
      "{} landmarks in both maps, {:.0f} % of those in the overlap; expected by chance: "
      "10^{:.0f}\n",
      merged.fused, 100.0 * alignment.share(), alignment.log10_false_alarm);
  fmt::print("{} landmarks, {} of them of the second map alone; doubled, it seems: {} ({:.2f} %)\n",
             merged.map.landmarks.size(), merged.added, merged.suspected_doubles,
             doubled_pct(merged));
  fmt::print("{}\n", where.empty() ? "nothing was written (--into or --out)" : "-> " + where);
}

nlohmann::ordered_json merge_json(const MapMergeOptions& options, const Alignment& alignment,
                                  const MergedMaps& merged, const std::string& where) {
  nlohmann::ordered_json covariance = nlohmann::ordered_json::array();
  for (const auto& row : alignment.covariance.rowwise())
    covariance.push_back({row(0), row(1), row(2)});
  const geometry::SE2& motion = alignment.first_T_second;
  return {{"first", options.first.string()},
          {"second", options.second.string()},
          {"offset", {{"x_m", motion.x()}, {"y_m", motion.y()}, {"heading_rad", motion.theta()}}},
          {"covariance", covariance},
          {"pairs", merged.fused},
          {"share", alignment.share()},
          {"log10_false_alarm", alignment.log10_false_alarm},
          {"landmarks", merged.map.landmarks.size()},
          {"added", merged.added},
          {"suspected_doubles", merged.suspected_doubles},
          {"doubled_pct", doubled_pct(merged)},
          {"written", where.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(where)}};
}

/// Writes the result as a change of `file`, unless its maps have changed since they were read.
void put_merged(const fs::path& file, const MapsToMerge& read, const MergedMaps& merged,
                const map_file::ChangeNote& note) {
  MapFile opened(file, map_file::Access::kWrite);
  const bool is_same =
      std::ranges::equal(opened.maps(), read.known, {}, &map_file::MapSummary::checksum,
                         &map_file::MapSummary::checksum);
  if (!is_same) fail(fmt::format("{}: was changed while its map was merged", file.string()));
  terminal::throw_if_interrupted();
  opened.put(std::vector<StoredMap>{merged.map, merged.trajectory}, note);
}

/// Writes the merged map; returns its place, empty = not written. A new file is a copy of the first
/// one including its history, with one more change.
std::string write_merged(const MapMergeOptions& options, const MapsToMerge& read,
                         const Alignment& alignment, const MergedMaps& merged) {
  if (options.into.empty() && options.out.empty()) return {};
  const std::string source =
      fmt::format("{} map {}", options.second.filename().string(), read.second_id);
  const map_file::ChangeNote note = note_now(
      "understory map merge", source,
      fmt::format("{} into map {}: {} landmarks fused, {} added; its frame lies at {}", source,
                  merged.map.map_id, merged.fused, merged.added, offset_text(alignment)));
  if (options.out.empty()) {
    put_merged(options.first, read, merged, note);
    return options.first.string();
  }
  map_file::NewFile copy(options.out);
  fs::copy_file(options.first, copy.path(), fs::copy_options::overwrite_existing);
  put_merged(copy.path(), read, merged, note);
  copy.move_to_its_name();
  return options.out.string();
}

/// Alignment from the stated pose. With --force, the stated pose is used even if landmarks do not
/// confirm it; then there are no common landmarks.
Alignment align_as_said(const MapMergeOptions& options, const MapsToMerge& maps,
                        const map_merge::AlignmentParameters& parameters) {
  const geometry::SE2WithCovariance first_T_at{maps.first_T_at, Eigen::Matrix3d::Zero()};
  const geometry::SE2WithCovariance at_T_second{maps.second_T_at.inverse(),
                                                Eigen::Matrix3d::Zero()};
  const auto guess = compound(compound(first_T_at, options.pose.pose()), at_T_second);
  Alignment alignment = map_merge::align_near(guess, map_merge::landmarks_of(maps.first),
                                              map_merge::landmarks_of(maps.second), parameters);
  if (alignment.found() || !options.force) return alignment;
  alignment = {};
  alignment.outcome = map_merge::AlignmentOutcome::kAligned;
  alignment.first_T_second = guess.mean;
  alignment.covariance = guess.covariance;
  return alignment;
}

Alignment align_shown(const MapsToMerge& maps, const map_merge::AlignmentParameters& parameters) {
  terminal::Progress progress("looking for the overlap", 1.0);
  return map_merge::align(map_merge::landmarks_of(maps.first), map_merge::landmarks_of(maps.second),
                          parameters, [&](double part) {
                            terminal::throw_if_interrupted();
                            progress.update(part);
                          });
}

/// Landmarks decide; the files' georeferences are compared with the result.
void report_references(const MapMergeOptions& options, const MapsToMerge& maps,
                       const Alignment& alignment) {
  if (maps.second_reference && !maps.first_reference)
    fmt::print(stderr,
               "{}: its place on the earth is not taken over, since the frame of {} stays "
               "(`understory map georeference`)\n",
               options.second.string(), options.first.string());
  if (!maps.first_reference || !maps.second_reference) return;
  const reference_system::Transformation between(maps.second_reference->definition,
                                                 maps.first_reference->definition);
  const Eigen::Vector2d middle_m = middle_of(maps.second);
  const double apart_m = (between.forward(middle_m) - alignment.first_T_second * middle_m).norm();
  if (apart_m > kSamePlace_m)
    fmt::print(stderr,
               "{} and {}: are {:.2f} m apart by their georeferences where their landmarks are the "
               "same; that of the first stays\n",
               options.first.string(), options.second.string(), apart_m);
}

void run_map_merge(const MapMergeOptions& options) {
  terminal::catch_interrupts();
  const MapsToMerge maps = read_maps_to_merge(options);
  const map_merge::AlignmentParameters parameters{.unknown_sigma_m = options.sigma_m};
  const Alignment alignment = options.pose.is_given() ? align_as_said(options, maps, parameters)
                                                      : align_shown(maps, parameters);
  if (!alignment.found())
    fail(fmt::format(
        "{} map {}, {} map {}: not merged: {}", options.first.string(), maps.first.map_id,
        options.second.string(), maps.second_id,
        alignment.reason(options.pose.is_given() ? with_guess(parameters) : parameters)));

  const MergedMaps merged =
      map_merge::fuse(maps.first, maps.second, alignment, {.unknown_sigma_m = options.sigma_m});
  const std::string where = write_merged(options, maps, alignment, merged);
  report_references(options, maps, alignment);
  if (options.json) {
    fmt::print("{}\n", result_text(merge_json(options, alignment, merged, where), 2));
  } else {
    print_merge(alignment, merged, where);
  }
}

/// The target map of the merge becomes the first one, whatever the order on the command line.
MapMergeOptions settled(MapMergeOptions options) {
  const bool has_ends = !options.first_at.empty() || !options.second_at.empty();
  if ((has_ends || options.force) && !options.pose.is_given())
    wrong_usage("map merge: --first-at, --second-at and --force are of a pose: --x-m is missing");
  if (options.into.empty()) return options;
  std::error_code ignored;
  if (fs::equivalent(options.into, options.first, ignored)) return options;
  if (!fs::equivalent(options.into, options.second, ignored))
    wrong_usage(fmt::format("--into {}: neither of the two files", options.into.string()));
  std::swap(options.first, options.second);
  std::swap(options.first_map, options.second_map);
  if (options.pose.is_given())
    wrong_usage("--into: with a pose the file that is merged into is the first one");
  return options;
}

}  // namespace

void add_map_merge(CLI::App& map) {
  auto* command = map.add_subcommand(
      "merge", "Merges two maps that overlap; without --into and --out it only shows the result");
  const auto options = std::make_shared<MapMergeOptions>();
  const auto number = CLI::Range(std::uint32_t{1}, map_file::kLastMapId);
  command->add_option("first", options->first, "A map file; its frame and ids stay")->required();
  command->add_option("second", options->second, "A map file; may be the same one")->required();
  command->add_option("--first-map", options->first_map, "Number of its map, if it has several")
      ->check(number);
  command->add_option("--second-map", options->second_map, "Likewise")->check(number);

  auto* into = command->add_option("--into", options->into,
                                   "One of the two files: it gets the merged map, in its frame");
  command
      ->add_option("--out", options->out,
                   "A new file: the first one with its history, and the merged map")
      ->excludes(into);
  command
      ->add_option("--sigma-m", options->sigma_m,
                   "[m] Standard deviation in x and in y of landmarks without covariance")
      ->check(CLI::Range(1e-6, 1e3))
      ->capture_default_str();
  command->add_option(
      "--first-at", options->first_at,
      "Frame of the pose: submap:N or keyframe:N of the first map (default: the map's frame)");
  command->add_option("--second-at", options->second_at,
                      "Part of the second map whose pose is given: likewise");
  add_said_pose(*command, options->pose, "--second-at in the frame of --first-at, if it is known",
                "pose-");
  command->add_flag("--force", options->force,
                    "Use the given pose even if the landmarks do not agree");
  command->add_flag("--json", options->json, "As JSON, on standard output");
  command->callback([options] { guarded_map_work([&] { run_map_merge(settled(*options)); }); });
}

}  // namespace understory::cli
