#include "deploy/cli/import_stem_frames.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "common/io/data_error.hpp"
#include "common/io/stem_frames.hpp"
#include "common/terminal/interrupt.hpp"
#include "deploy/cli/guarded_import.hpp"
#include "deploy/cli/recording_log.hpp"
#include "understory/ground_truth_t.hpp"

namespace understory::cli {
namespace {

/// An odometry that states no error at all could not be told from a truth [m], [rad].
constexpr double kLeastOdometrySigmaM = 1e-4;
constexpr double kLeastOdometrySigmaRad = 1e-5;
/// The field of view ends where a stem can still be, by so much beyond the farthest one seen [m].
constexpr double kBeyondFarthestStemM = 1.0;

struct StemFramesOptions {
  std::string folder;
  std::string out;
  double odometry_percent = 1.0;
  double odometry_deg = 0.3;
  double sigma_m = 0.1;
  std::uint64_t seed = 1;
};

double farthest_stem_m(const std::vector<model::StemFrame>& frames) {
  double farthest = 0.0;
  for (const model::StemFrame& frame : frames) {
    for (const model::Detection& stem : model::level_scan(frame, 1.0, 0.0).detections)
      farthest = std::max(farthest, stem.position_m.head<2>().norm());
  }
  return farthest;
}

/// The true motion with the noise that the options state, the same for the same seed.
class NoisyOdometry {
 public:
  explicit NoisyOdometry(const StemFramesOptions& options)
      : options_(options), random_(options.seed) {}

  model::Odometry between(const model::StemFrame& from, const model::StemFrame& to) {
    const geometry::SE2 motion = model::level_pose(from).inverse() * model::level_pose(to);
    const double along_m = 0.01 * options_.odometry_percent * motion.translation().norm();
    const double turn_rad = options_.odometry_deg * std::numbers::pi / 180.0;
    const double x = normal_(random_), y = normal_(random_), z = normal_(random_);
    const Eigen::Vector3d noise(along_m * x, along_m * y, turn_rad * z);

    model::Odometry odometry;
    odometry.from_utime = from.utime;
    odometry.utime = to.utime;
    odometry.from_T_to = motion * geometry::SE2::Exp(noise);
    const Eigen::Vector3d sigma(std::max(along_m, kLeastOdometrySigmaM),
                                std::max(along_m, kLeastOdometrySigmaM),
                                std::max(turn_rad, kLeastOdometrySigmaRad));
    odometry.covariance = sigma.array().square().matrix().asDiagonal();
    odometry.has_wheels = true;
    return odometry;
  }

 private:
  const StemFramesOptions& options_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_{0.0, 1.0};
};

void write_frames(const std::vector<model::StemFrame>& frames, const StemFramesOptions& options) {
  RecordingLog log(options.out);
  NoisyOdometry odometry(options);
  const double range_m = farthest_stem_m(frames) + kBeyondFarthestStemM;

  for (std::size_t i = 0; i < frames.size(); ++i) {
    terminal::throw_if_interrupted();
    ground_truth_t truth{};
    truth.utime = frames[i].utime;
    truth.world_T_vehicle = wire::to_wire(model::level_pose(frames[i]));
    log.add("GROUND_TRUTH", truth);
    if (i > 0) log.add("ODOMETRY", odometry.between(frames[i - 1], frames[i]));
    log.add("LANDMARKS", model::level_scan(frames[i], options.sigma_m, range_m));
  }

  log.commit();
}

void import_stem_frames(const StemFramesOptions& options) {
  guarded_import([&] {
    const std::vector<model::StemFrame> frames = io::read_stem_frames(options.folder);
    write_frames(frames, options);
    std::size_t stems = 0;
    for (const model::StemFrame& frame : frames) stems += frame.stems.size();
    fmt::print("{} frames, {} stems -> {}\n", frames.size(), stems, options.out);
  });
}

}  // namespace

void add_stem_frames_import(CLI::App& import) {
  auto* command = import.add_subcommand(
      "stem-frames", "Detected stems, a table for each frame, with the trajectory of the sensor");
  auto options = std::make_shared<StemFramesOptions>();
  command
      ->add_option(
          "folder", options->folder,
          "Folder with frame_<n>.csv (x_m,y_m[,z_m][,axis_x,axis_y,axis_z][,dbh_m][,score]) "
          "and trajectory.txt (TUM)")
      ->required();
  command->add_option("--out", options->out, "The log to write")->required();

  command
      ->add_option("--odometry-percent", options->odometry_percent,
                   "Noise of ODOMETRY, 1 sigma per axis, in percent of the distance")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str();
  command
      ->add_option("--odometry-deg", options->odometry_deg,
                   "Noise of the heading of ODOMETRY, 1 sigma per frame [degrees]")
      ->check(CLI::Range(0.0, 90.0))
      ->capture_default_str();
  command->add_option("--seed", options->seed, "Seed of the noise")->capture_default_str();
  command
      ->add_option("--sigma-m", options->sigma_m,
                   "Standard deviation that LANDMARKS state, per axis [m]")
      ->check(CLI::Range(1e-3, 10.0))
      ->capture_default_str();
  command->callback([options] { import_stem_frames(*options); });
}

}  // namespace understory::cli
