#include "deploy/cli/sim_changes.hpp"

#include <fmt/format.h>

#include <memory>
#include <stdexcept>
#include <string>

#include "common/io/data_error.hpp"
#include "common/io/lcm_log.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/progress.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/sensor_simulation.hpp"
#include "sim/changes/data_set.hpp"
#include "sim/hash_random.hpp"

namespace understory::cli {
namespace {

namespace changes = sim::changes;

struct ChangesOptions {
  std::string world = "office";
  std::string out;
  bool no_lidar = false;
  int clear_cut = 0;  ///< Number of trees; 0 = random changes instead.
  int copies = 3;
  std::uint64_t seed = 1;
  changes::CourseParameters course;
  changes::DiffParameters diff;
  double recall = -1.0;  ///< Negative = that of the world's camera.
  double false_per_frame = -1.0;
};

changes::SceneKind scene_of(const ChangesOptions& options) {
  const auto kind = changes::scene_kind(options.world);
  if (!kind) wrong_usage(fmt::format("--world {}: no such world", options.world));
  return *kind;
}

changes::CameraParameters camera_of(const ChangesOptions& options, changes::SceneKind kind) {
  changes::CameraParameters camera = changes::camera_for(kind);
  if (options.recall >= 0.0) camera.recall = options.recall;
  if (options.false_per_frame >= 0.0) camera.false_per_frame = options.false_per_frame;
  return camera;
}

/// The diff of a copy; the first one has none. Ids of new objects differ from copy to copy.
changes::Diff diff_of(const changes::Course& course, const ChangesOptions& options, int copy) {
  constexpr changes::ThingId kIdsPerCopy = 10'000;
  if (copy == 0) return {};
  const std::uint64_t seed = sim::mixed(options.seed, static_cast<std::uint64_t>(copy));
  const changes::ThingId first_id =
      course.scene.next_id + static_cast<changes::ThingId>(copy - 1) * kIdsPerCopy;
  if (options.clear_cut == 0) return changes::make_diff(course, options.diff, seed, first_id);
  changes::ClearCutParameters patch;
  patch.felled = options.clear_cut;
  return changes::make_clear_cut(course, patch, seed, first_id);
}

void write_copy_log(const changes::Replay& replay, const ChangesOptions& options,
                    changes::SceneKind kind, std::uint64_t seed, changes::DataSetWriter& writer) {
  if (options.no_lidar) return;
  sim::SensorDrive drive = replay.sensors(changes::suite_for(kind), seed);
  terminal::Progress progress("LIDAR and IMU", drive.motion().duration_s());
  write_sensor_log(drive, writer.path_in_copy("drive.lcm").string(),
                   [&](double done_s) { progress.update(done_s); });
  writer.add_file("drive.lcm");
}

void write_data_set(const ChangesOptions& options) {
  const changes::SceneKind kind = scene_of(options);
  if (options.clear_cut > 0 && kind != changes::SceneKind::kForest)
    wrong_usage(fmt::format("--clear-cut: there are no trees in --world {}", options.world));
  const changes::CameraParameters camera = camera_of(options, kind);
  const changes::Course course = changes::make_course(kind, options.course, options.seed);
  changes::DataSetWriter writer(
      options.out, {kind, options.seed, options.diff.share, options.diff.move_m, camera});

  for (int copy = 0; copy <= options.copies; ++copy) {
    const changes::Diff diff = diff_of(course, options, copy);
    const changes::Replay replay(course, diff);
    const std::uint64_t seed = sim::mixed(options.seed, 0x5eed0U + static_cast<unsigned>(copy));
    changes::ChangedDrive drive;
    {
      terminal::Progress progress("camera", 1.0);
      drive = replay.drive(camera, seed, [&](double done) {
        terminal::throw_if_interrupted();
        progress.update(done);
      });
    }
    writer.add(drive, replay.copy());
    write_copy_log(replay, options, kind, seed, writer);
    fmt::print("copy_{}: {} frames, {} removed, {} moved, {} new, {} that hide\n", copy,
               drive.frames.size(), diff.removed.size(), diff.moved.size(), diff.added.size(),
               diff.occluders.size());
  }
  writer.commit();
}

void simulate_changes(const ChangesOptions& options) {
  terminal::catch_interrupts();
  try {
    write_data_set(options);
  } catch (const io::DataError& error) {
    fail(error.what());
  } catch (const io::LogError& error) {
    fail(error.what());
  } catch (const terminal::Interrupted& error) {
    fail(fmt::format("sim changes: {}; {} was not written", error.what(), options.out));
  } catch (const std::runtime_error& error) {
    if (dynamic_cast<const CLI::Error*>(&error) != nullptr) throw;
    fail(fmt::format("sim changes --world {}: {}", options.world, error.what()));
  }
}

void add_object_options(CLI::App& command, changes::DiffParameters& diff) {
  command.add_option("--share", diff.share, "Share of the objects that are removed or moved")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command
      .add_option("--moved", diff.moved_share,
                  "Share of these objects that are moved, if they can be")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command.add_option("--move", diff.move_m, "Distance by which objects are moved [m]")
      ->check(CLI::Range(0.01, 10.0))
      ->capture_default_str();
  command.add_option("--added", diff.added_share, "New objects per removed one")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
}

void add_diff_options(CLI::App& command, ChangesOptions& options) {
  add_object_options(command, options.diff);
  command
      .add_option("--clear-cut", options.clear_cut,
                  "forest: instead of these changes, fell this many neighbouring trees and park a "
                  "lorry that hides about 20 others")
      ->check(CLI::Range(0, 100'000))
      ->capture_default_str();
  command.add_option("--hiding", options.diff.occluders, "Lorries or carts parked beside the path")
      ->check(CLI::Range(0, 100))
      ->capture_default_str();
}

void add_course_options(CLI::App& command, ChangesOptions& options) {
  command.add_option("--laps", options.course.laps, "Laps of the path")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command.add_option("--length", options.course.length_m, "forest: length of a lap [m]")
      ->check(CLI::Range(40.0, 5000.0))
      ->capture_default_str();
  command.add_flag("--no-lidar", options.no_lidar, "Write no drive.lcm: only camera and truth");
  command.add_option("--recall", options.recall, "Recall of the camera's detector")
      ->check(CLI::Range(0.0, 1.0));
  command
      .add_option("--false-keypoints", options.false_per_frame,
                  "Mean number of false keypoints in a frame")
      ->check(CLI::Range(0.0, 1e4));
}

}  // namespace

void add_changes_simulation(CLI::App& sim) {
  auto* command =
      sim.add_subcommand("changes",
                         "One path through an unchanged world and changed copies of it: a data set "
                         "of keypoints, LIDAR, IMU and the true changes");
  auto options = std::make_shared<ChangesOptions>();
  command->add_option("--world", options->world, "Kind of world")
      ->check(CLI::IsMember(changes::scene_names()))
      ->capture_default_str();
  command->add_option("--out", options->out, "The folder to write; new or empty")->required();
  command->add_option("--copies", options->copies, "Changed copies beside the unchanged one")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  add_diff_options(*command, *options);
  add_course_options(*command, *options);
  command->add_option("--seed", options->seed, "Seed of world, changes and noise")
      ->capture_default_str();
  command->callback([options] { simulate_changes(*options); });
}

}  // namespace understory::cli
