// `understory eval misstated`: noise, mounting, clocks and wheels that are not as stated.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>

#include "common/terminal/interrupt.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/health/health_drive.hpp"
#include "eval/harness/campaign.hpp"
#include "eval/harness/results.hpp"
#include "eval/tools/parallel.hpp"

namespace understory::eval::experiments::misstated {
namespace {

struct MisstatedOptions {
  int runs = 4;
  std::uint64_t seed = 1;
  int jobs = 1;
  std::string only;
  std::filesystem::path json;
};

constexpr std::array kSigmaFactors = {1.0, 0.25, 0.5, 0.71, 1.41, 2.0, 4.0};

/// One row of the table: several drives with the same thing wrong.
struct Row {
  std::string drive;  ///< "circle": ideal landmarks alone; "forest": with odometry and filter.
  std::string what;
  int runs = 0;
  int updates = 0;
  int updates_possible = 0;
  int wrong = 0;  ///< Accepted keyframes (circle) or poses of either channel (forest) over 1 m off.
  int poses = 0;
  double log_slam = 0.0;    ///< Sum over the runs of the logarithm of the error [m].
  double log_filter = 0.0;  ///< Likewise; forest alone.
  double sum_nees = 0.0;    ///< Of SLAM_POSE (forest) or the updates (circle), mean of each run.
  int runs_named = 0;       ///< HEALTH of any process was not OK for over a tenth of the scans.

  double slam_m() const { return runs == 0 ? 0.0 : std::exp(log_slam / runs); }
  double filter_m() const { return runs == 0 ? 0.0 : std::exp(log_filter / runs); }
};

double log_of(double error_m) { return std::log(std::max(error_m, 1e-6)); }

/// The thesis's circle with 20 cm noise; no odometry.
void circle(double stated_factor, const MisstatedOptions& options, std::size_t run, Row& row) {
  sim::DriveParameters parameters = harness::Cell{}.drive();
  parameters.sensor.stated_factor = stated_factor;
  const harness::RecordedDrive drive(parameters,
                                     harness::run_seed(options.seed, static_cast<int>(run)));
  const harness::RunScore score =
      harness::run_slam(drive, harness::make_stages("smoothing"), terminal::catch_interrupts())
          .score;

  double nees = 0.0;
  for (const auto& [keyframe, value] : score.nees) nees += value;
  ++row.runs;
  row.updates += score.updates;
  row.updates_possible += score.updates_possible;
  row.wrong += score.wrong_updates;
  row.poses += score.updates;
  row.log_slam += log_of(score.ate_m);
  row.sum_nees += nees / static_cast<double>(std::max<std::size_t>(score.nees.size(), 1));
}

/// A drive with IMU, wheels and detections of a few centimetres, through four stages.
void forest(const health::Fault& fault, const MisstatedOptions& options, std::size_t run,
            Row& row) {
  const health::DrivePlan plan{.seconds = 60.0, .fault_at_s = 0.0, .fault_lasts_s = 1e9};
  const health::DriveVerdict verdict = drive(fault, plan, options.seed + run);
  ++row.runs;
  row.poses += verdict.slam.poses + verdict.filter.poses;
  row.wrong += verdict.slam.wrong + verdict.filter.wrong;
  row.log_slam += log_of(verdict.slam.ate_m);
  row.log_filter += log_of(verdict.filter.ate_m);
  row.sum_nees += verdict.slam.mean_nees;
  if (10 * verdict.scans_not_ok > verdict.scans) ++row.runs_named;
}

health::Meddle each_detection(const std::function<void(model::Detection&)>& change) {
  return [change](sim::DriveStep& step, std::mt19937_64&) {
    std::ranges::for_each(step.scan.detections, change);
  };
}

/// What may be wrong with the vehicle of the second part, from the first scan to the last.
std::vector<health::Fault> wrong_statements() {
  std::vector<health::Fault> result;
  result.reserve(kSigmaFactors.size() + 7);
  for (const double factor : kSigmaFactors) {
    result.push_back({fmt::format("sigma stated x {}", factor), each_detection([factor](auto& one) {
                        one.covariance_m2 *= factor * factor;
                      })});
  }

  // Mounting and clock.
  const Eigen::Rotation2Dd rotated(2.0 * std::numbers::pi / 180.0);
  result.push_back({"mounted 2 degrees off", each_detection([rotated](auto& one) {
                      one.position_m.template head<2>() =
                          rotated * Eigen::Vector2d(one.position_m.template head<2>());
                    })});
  result.push_back(
      {"mounted 5 cm ahead", each_detection([](auto& one) { one.position_m.x() += 0.05; })});
  result.push_back(
      {"mounted 5 cm to the left", each_detection([](auto& one) { one.position_m.y() += 0.05; })});
  result.push_back({"scans stamped 20 ms late", health::late_by(0.02)});

  // Shaken: each scan is turned as a whole, which no covariance of a single detection states.
  result.push_back({"vibration of 0.3 degrees", [](sim::DriveStep& step, std::mt19937_64& random) {
                      std::normal_distribution<double> yaw(0.0, 0.3 * std::numbers::pi / 180.0);
                      const Eigen::Rotation2Dd shaken(yaw(random));
                      for (model::Detection& one : step.scan.detections) {
                        one.position_m.head<2>() =
                            shaken * Eigen::Vector2d(one.position_m.head<2>());
                      }
                    }});

  // Wheels of another size.
  for (const double factor : {0.97, 1.03}) {
    result.push_back(
        {fmt::format("odometry x {}", factor), [factor](sim::DriveStep& step, std::mt19937_64&) {
           for (model::Odometry& one : step.odometry) {
             one.from_T_to =
                 geometry::SE2(factor * one.from_T_to.translation(), one.from_T_to.theta());
           }
         }});
  }
  return result;
}

nlohmann::json to_json(const Row& row, const Row& as_stated) {
  return {{"drive", row.drive},
          {"what", row.what},
          {"runs", row.runs},
          {"updates", row.updates},
          {"updates_possible", row.updates_possible},
          {"poses", row.poses},
          {"wrong", row.wrong},
          {"slam_m", row.slam_m()},
          {"filter_m", row.filter_m()},
          {"slam_ratio", row.slam_m() / as_stated.slam_m()},
          {"filter_ratio", row.filter_m() / as_stated.filter_m()},
          {"nees", row.sum_nees / std::max(row.runs, 1)},
          {"runs_named", row.runs_named}};
}

void run(const MisstatedOptions& options) {
  const std::vector<health::Fault> statements = wrong_statements();
  std::vector<Row> rows;
  rows.reserve(kSigmaFactors.size() + statements.size());
  for (const double factor : kSigmaFactors) {
    rows.push_back({.drive = "circle", .what = fmt::format("sigma stated x {}", factor)});
  }
  for (const health::Fault& one : statements) rows.push_back({.drive = "forest", .what = one.name});

  tools::run_in_parallel(
      rows.size(), options.jobs, "rows", terminal::catch_interrupts(), [&](std::size_t i) {
        const bool is_reference = i == 0 || i == kSigmaFactors.size();
        if (!is_reference && rows[i].what.find(options.only) == std::string::npos) return;
        for (std::size_t k = 0; k < static_cast<std::size_t>(options.runs); ++k) {
          if (i < kSigmaFactors.size()) {
            circle(kSigmaFactors[i], options, k, rows[i]);
          } else {
            forest(statements[i - kSigmaFactors.size()], options, k, rows[i]);
          }
        }
      });

  fmt::print("{:<7} {:<26} {:>5} {:>11} {:>7} {:>6} {:>8} {:>6} {:>8} {:>6} {:>8} {:>6}\n", "drive",
             "what", "runs", "updates", "poses", "wrong", "SLAM m", "ratio", "EKF m", "ratio",
             "NEES", "named");
  nlohmann::json table = nlohmann::json::array();
  for (const Row& row : rows) {
    if (row.runs == 0) continue;
    const Row& as_stated = row.drive == "circle" ? rows.front() : rows[kSigmaFactors.size()];
    table.push_back(to_json(row, as_stated));
    const bool has_filter = row.drive == "forest";
    fmt::print(
        "{:<7} {:<26} {:>5} {:>11} {:>7} {:>6} {:>8.4f} {:>6.2f} {:>8} {:>6} {:>8.2f} {:>6}\n",
        row.drive, row.what, row.runs,
        has_filter ? "" : fmt::format("{}/{}", row.updates, row.updates_possible), row.poses,
        row.wrong, row.slam_m(), row.slam_m() / as_stated.slam_m(),
        has_filter ? fmt::format("{:.4f}", row.filter_m()) : "",
        has_filter ? fmt::format("{:.2f}", row.filter_m() / as_stated.filter_m()) : "",
        row.sum_nees / std::max(row.runs, 1), has_filter ? fmt::format("{}", row.runs_named) : "");
  }
  if (options.json.empty()) return;
  nlohmann::json config = {{"runs", options.runs}, {"seed", options.seed}};
  if (!options.only.empty()) config["only"] = options.only;
  harness::write_json(options.json, harness::result_document("misstated", config, table));
}

}  // namespace

void add_misstated_experiment(CLI::App& eval) {
  auto* command = eval.add_subcommand(
      "misstated", "Drives whose sensors are not as stated: noise, mounting, clock, wheels");
  auto options = std::make_shared<MisstatedOptions>();
  add_number(*command, "--runs", options->runs, 1, 100000, "Drives per row");
  command->add_option("--seed", options->seed, "Seed of all randomness")->capture_default_str();
  command->add_option("--only", options->only,
                      "Only rows whose text contains this, and those without a fault");
  add_number(*command, "--jobs", options->jobs, 1, 1024, "Rows side by side");
  command->add_option("--json", options->json, "Result file");
  command->callback([options] { run_guarded("misstated", [&] { run(*options); }); });
}

}  // namespace understory::eval::experiments::misstated
