#include "eval/experiments/large_map/large_map.hpp"

#include <fmt/format.h>
#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <string>

#include "common/terminal/interrupt.hpp"
#include "eval/experiments/experiments.hpp"
#include "eval/experiments/large_map/large_map_methods.hpp"
#include "eval/harness/results.hpp"
#include "eval/harness/slam_session.hpp"
#include "eval/tools/parallel.hpp"
#include "eval/tools/quantile.hpp"
#include "eval/tools/thread_clock.hpp"
#include "eval/tools/yardstick.hpp"
#include "sim/drive.hpp"

namespace understory::eval::experiments::large_map {
namespace {

constexpr int kScansPerKeyframe = 8;
constexpr double kWrong_m = 1.0;

struct LargeMapOptions {
  harness::CampaignOptions campaign;
  double side_km = 1.0;
};

/// One row of the table per method.
struct Setting {
  std::string name;
  sim::ForestKind forest = sim::ForestKind::kIntermediate;
  double detection = 0.9;
  double sigma_m = 0.2;
  double false_share = 0.0;   ///< Of all points of an observation.
  bool single_scans = false;  ///< Every eighth scan by itself instead of keyframes.
};

std::vector<Setting> settings() {
  using sim::ForestKind;
  return {{"default"},
          {"detection-80", ForestKind::kIntermediate, 0.8},
          {"sparse", ForestKind::kSparse},
          {"dense", ForestKind::kDense},
          {"detection-60-false-50", ForestKind::kIntermediate, 0.6, 0.2, 0.5},
          {"scan", ForestKind::kIntermediate, 0.9, 0.2, 0.0, true},
          {"scan-detection-60-false-50", ForestKind::kIntermediate, 0.6, 0.2, 0.5, true}};
}

/// A keyframe and where its scans were really taken.
struct PlaceQuestion {
  model::Keyframe keyframe;
  std::vector<geometry::SE2> world_T_member;  ///< [0] is the base.
};

model::Keyframe keyframe_of(const model::LandmarkScan& scan) {
  model::Keyframe keyframe;
  keyframe.utime = scan.utime;
  keyframe.field_of_view = scan.field_of_view;
  keyframe.members.push_back({scan.utime, scan.sequence, geometry::SE2(), Eigen::Matrix3d::Zero()});
  for (const model::Detection& detection : scan.detections) {
    keyframe.landmarks.push_back({detection.position_m.head<2>(),
                                  detection.covariance_m2.topLeftCorner<2, 2>(), detection.radius_m,
                                  1, detection.kind});
  }
  return keyframe;
}

/// False landmarks, uniform in the field of view and as exact as the true ones claim to be, until
/// they are `share` of all.
void add_false_landmarks(model::Keyframe& keyframe, double share, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const std::size_t real = keyframe.landmarks.size();
  const auto wanted =
      static_cast<std::size_t>(std::lround(static_cast<double>(real) * share / (1.0 - share)));
  for (std::size_t i = 0; i < wanted && real > 0; ++i) {
    model::KeyframeLandmark landmark = keyframe.landmarks[random() % real];
    const double range = keyframe.field_of_view.max_range_m * std::sqrt(unit(random));
    const double bearing = 2.0 * std::numbers::pi * unit(random);
    landmark.position_m = {range * std::cos(bearing), range * std::sin(bearing)};
    keyframe.landmarks.push_back(landmark);
  }
  std::shuffle(keyframe.landmarks.begin(), keyframe.landmarks.end(), random);
}

geometry::SE2 true_pose(const sim::Drive& drive, model::Utime utime) {
  const auto interval = static_cast<double>(drive.utime(1) - drive.utime(0));
  const auto index = std::lround(static_cast<double>(utime - drive.utime(0)) / interval);
  return drive.world_T_vehicle()[static_cast<std::size_t>(index)];
}

/// The keyframes of one circle.
std::vector<PlaceQuestion> questions_of(const Setting& setting, const std::string& method,
                                        const sim::Forest& forest, std::uint64_t seed) {
  sim::DriveParameters parameters;
  parameters.sensor.detection_probability = setting.detection;
  parameters.sensor.position_sigma_m = setting.sigma_m;
  const sim::Drive drive(parameters, forest, seed);

  const auto keyframer = harness::make_stages(method).keyframer;
  std::mt19937_64 random(seed ^ 0x9E3779B97F4A7C15ULL);
  std::vector<PlaceQuestion> questions;

  for (std::size_t k = 0; k < drive.size(); ++k) {
    std::optional<model::Keyframe> keyframe;
    if (!setting.single_scans) {
      keyframe = keyframer.add(drive.scan(k).scan);
    } else if (k % kScansPerKeyframe == 0) {
      keyframe = keyframe_of(drive.scan(k).scan);
    }
    if (!keyframe) continue;

    if (setting.false_share > 0.0) add_false_landmarks(*keyframe, setting.false_share, random);

    PlaceQuestion question{std::move(*keyframe), {}};
    for (const model::KeyframeMember& member : question.keyframe.members) {
      question.world_T_member.push_back(true_pose(drive, member.utime));
    }
    questions.push_back(std::move(question));
  }
  return questions;
}

struct Score {
  std::size_t keyframes = 0;
  std::size_t landmarks = 0;
  int within_0_10m = 0;       ///< The keyframe as a whole.
  int base_within_0_10m = 0;  ///< The pose of its first scan alone.
  int within_0_5m = 0;
  int wrong = 0;
  int unsure = 0;
  std::vector<double> ms;
  std::vector<double> error_m;  ///< Of the keyframe: the mean of its scans' positions.
  double bytes_per_landmark = 0.0;
};

/// Of the mean of all members' positions. The base alone is one scan's worth of information (at 20
/// cm noise 2.6 cm per axis), whatever the method; the keyframe as a whole is eight scans' worth.
double keyframe_error_m(const PlaceQuestion& question, const geometry::SE2& map_T_base) {
  const geometry::SE2 map_T_centre = map_T_base * question.keyframe.centre_T_base().inverse();
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < question.world_T_member.size(); ++i) {
    sum += map_T_centre * question.keyframe.members[i].centre_T_vehicle.translation() -
           question.world_T_member[i].translation();
  }
  return sum.norm() / static_cast<double>(question.world_T_member.size());
}

void ask(const PlaceFinder& finder, const PlaceQuestion& question, Score& score) {
  const double start = tools::thread_time_s();
  const std::optional<geometry::SE2> map_T_base = finder.find(question.keyframe);
  score.ms.push_back(1e3 * (tools::thread_time_s() - start));
  ++score.keyframes;

  if (!map_T_base) {
    ++score.unsure;
    return;
  }

  const double error = keyframe_error_m(question, *map_T_base);
  const double base_error =
      (map_T_base->translation() - question.world_T_member[0].translation()).norm();

  score.error_m.push_back(error);
  score.within_0_10m += error <= 0.1 ? 1 : 0;
  score.base_within_0_10m += base_error <= 0.1 ? 1 : 0;
  score.within_0_5m += error <= 0.5 ? 1 : 0;
  score.wrong += error > kWrong_m ? 1 : 0;
}

Score run_setting(const Setting& setting, const std::string& method, const LargeMapOptions& options,
                  const std::atomic<bool>& stop) {
  sim::ForestParameters parameters = sim::forest_parameters(setting.forest);
  parameters.side_m = 1000.0 * options.side_km;
  std::mt19937_64 random(options.campaign.seed);
  const sim::Forest forest = sim::make_forest(parameters, random);
  const auto finder = make_place_finder(method, forest.trunks_m);

  std::vector<std::vector<PlaceQuestion>> questions(
      static_cast<std::size_t>(options.campaign.runs));
  tools::run_in_parallel(
      questions.size(), options.campaign.jobs, fmt::format("circles, {} {}", setting.name, method),
      stop, [&](std::size_t run) {
        questions[run] =
            questions_of(setting, method, forest,
                         harness::run_seed(options.campaign.seed, static_cast<int>(run)));
      });
  Score score;
  score.landmarks = forest.trunks_m.size();
  score.bytes_per_landmark = finder->bytes_per_landmark();
  for (const auto& circle : questions) {
    for (const PlaceQuestion& question : circle) ask(*finder, question, score);
  }
  return score;
}

nlohmann::json row_of(const Setting& setting, const std::string& method, const Score& score,
                      double yardstick_ms) {
  nlohmann::json row{{"method", method},
                     {"setting", setting.name},
                     {"forest", sim::to_string(setting.forest)},
                     {"landmarks", score.landmarks},
                     {"detection_pct", 100.0 * setting.detection},
                     {"sigma_cm", 100.0 * setting.sigma_m},
                     {"false_pct", 100.0 * setting.false_share},
                     {"observation", setting.single_scans ? "scan" : "keyframe"},
                     {"keyframes", score.keyframes},
                     {"within_0_10m", score.within_0_10m},
                     {"within_0_5m", score.within_0_5m},
                     {"wrong", score.wrong},
                     {"unsure", score.unsure},
                     {"error_p50_cm", 100.0 * tools::quantile(score.error_m, 0.5)},
                     {"error_max_cm", 100.0 * tools::quantile(score.error_m, 1.0)},
                     {"base_within_0_10m", score.base_within_0_10m},
                     {"ms_p50", tools::quantile(score.ms, 0.5)},
                     {"ms_p99", tools::quantile(score.ms, 0.99)},
                     {"ms_max", tools::quantile(score.ms, 1.0)},
                     {"yardstick_ms", yardstick_ms},
                     {"ratio", tools::quantile(score.ms, 0.5) / yardstick_ms}};
  if (score.bytes_per_landmark > 0.0) row["bytes_per_landmark"] = score.bytes_per_landmark;
  return row;
}

void print_rows(const nlohmann::json& rows, double yardstick_ms) {
  fmt::print("{:<27} {:<7} {:>9} {:>9} {:>7} {:>7} {:>6} {:>6} {:>7} {:>8} {:>8} {:>8} {:>8}\n",
             "setting", "method", "keyframes", "<= 0.1 m", "(base)", "<= .5 m", "wrong", "unsure",
             "p50 cm", "p50 ms", "p99 ms", "max ms", "/Delaun.");

  for (const nlohmann::json& row : rows) {
    fmt::print(
        "{:<27} {:<7} {:>9} {:>9} {:>7} {:>7} {:>6} {:>6} {:>7.2f} {:>8.3f} {:>8.3f} {:>8.3f} "
        "{:>8.4f}\n",
        row["setting"].get<std::string>(), row["method"].get<std::string>(),
        row["keyframes"].get<int>(), row["within_0_10m"].get<int>(),
        row["base_within_0_10m"].get<int>(), row["within_0_5m"].get<int>(), row["wrong"].get<int>(),
        row["unsure"].get<int>(), row["error_p50_cm"].get<double>(), row["ms_p50"].get<double>(),
        row["ms_p99"].get<double>(), row["ms_max"].get<double>(), row["ratio"].get<double>());
  }

  fmt::print(
      "<= 0.1 m: the keyframe (mean of its scans' positions); (base): its first scan alone, whose "
      "own "
      "noise\nleaves 2.6 cm per axis whatever the method, so one in some thousand lies beyond\n");
  fmt::print("GeoSLAM §5.4: 1244 of 1250 within 0.5 m, 4 more within 1 m, 129 + 179 ms\n");
  fmt::print("yardstick: CGAL Delaunay of 13,770 points in {:.2f} ms\n", yardstick_ms);
}

void run_large_map(const LargeMapOptions& options) {
  const std::atomic<bool>& stop = terminal::catch_interrupts();
  const double yardstick_ms = 1e3 * tools::delaunay_build_s();
  nlohmann::json rows = nlohmann::json::array();

  for (const Setting& setting : settings()) {
    for (const std::string& method : options.campaign.methods) {
      if (method == "oracle") continue;
      const Score score = run_setting(setting, method, options, stop);
      rows.push_back(row_of(setting, method, score, yardstick_ms));
    }
  }

  print_rows(rows, yardstick_ms);
  if (options.campaign.json.empty()) return;

  const nlohmann::json config{{"seed", options.campaign.seed},
                              {"runs", options.campaign.runs},
                              {"side_km", options.side_km},
                              {"yardstick_ms", yardstick_ms}};
  harness::write_json(options.campaign.json, harness::result_document("large-map", config, rows));
}

}  // namespace

void add_large_map_experiment(CLI::App& eval) {
  CLI::App& command = *eval.add_subcommand(
      "large-map", "Every keyframe localised on its own in a whole forest (no prior)");
  const auto options = std::make_shared<LargeMapOptions>();
  options->campaign.methods = {"baseline", "smoothing"};
  add_campaign_options(command, options->campaign);
  add_number(command, "--side-km", options->side_km, 0.3, 20.0, "Side of the square forest");
  command.callback([options] { run_guarded("large-map", [&] { run_large_map(*options); }); });
}

}  // namespace understory::eval::experiments::large_map
