// Trunks in real forest plots, as a spinning LIDAR observes them (forest_plot.hpp).
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "eval/experiments/frontend/forest_plot_score.hpp"
#include "eval/experiments/frontend/frontend.hpp"
#include "eval/tools/parallel.hpp"

namespace understory::eval::experiments::frontend {
namespace {

struct PlotLidar {
  const char* name;
  sim::LidarModel model;
};
const PlotLidar kPlotLidars[] = {{"16 beams", sim::LidarModel::kVlp16},
                                 {"32 beams", sim::LidarModel::kVlp32},
                                 {"64 beams", sim::LidarModel::kHdl64}};
const char* const kPlots[] = {"TLS_Clip", "pine_plot"};

nlohmann::json trace_of(const ForestPlot& plot, const PlotScore& score) {
  nlohmann::json points = nlohmann::json::array();
  for (const PlotPoint& point : plot.points) {
    points.push_back({point.position_m.x(), point.position_m.y(), point.height_m});
  }

  nlohmann::json stems = nlohmann::json::array();
  for (std::size_t i = 0; i < plot.stems.size(); ++i) {
    const PlotStem& stem = plot.stems[i];
    stems.push_back({stem.position_m.x(), stem.position_m.y(), stem.radius_m,
                     score.should_of_stem[i], score.found_of_stem[i]});
  }

  nlohmann::json detections = nlohmann::json::array();
  for (const PlotDetection& one : score.detections) {
    detections.push_back({one.position_m.x(), one.position_m.y(), one.radius_m, one.stem});
  }

  nlohmann::json stations = nlohmann::json::array();
  for (const Eigen::Vector2d& place : score.stations_m) {
    stations.push_back({place.x(), place.y()});
  }

  return {{"points", points}, {"stems", stems}, {"detections", detections}, {"stations", stations}};
}

void add_errors(const char* of, const PlotErrors& errors, FrontendRows& rows) {
  const auto state = [&](const char* what, double value, const char* unit) {
    rows.state(fmt::format("{}: {}", of, what), value, unit);
  };
  state("detections", static_cast<double>(errors.detections), "");
  state("difference of the centres, RMS", 100.0 * errors.difference_m, "cm");
  state("spread of a stem's centres, RMS", 100.0 * errors.spread_m, "cm");
  state("NEES about a stem's mean (2)", errors.nees, "");
  state("radius, mean difference", 100.0 * errors.radius_bias_m, "cm");
}

void add_rows(const PlotScore& score, FrontendRows& rows) {
  const auto ever = [](const std::vector<std::uint32_t>& counts) {
    return static_cast<double>(std::ranges::count_if(counts, [](auto n) { return n > 0; }));
  };

  rows.state("stems to be found", static_cast<double>(score.should), "");
  rows.state("stems found of those with 5 returns", score.recall(), "");
  rows.state("detections that are a stem", score.precision(), "");
  rows.state("corners (there are none)", static_cast<double>(score.corners), "");
  add_errors("near side shown", score.whole, rows);
  add_errors("all", score.all, rows);

  const auto refused = [&](const char* why, std::uint64_t count) {
    rows.state(fmt::format("refused columns: {}", why), static_cast<double>(count), "");
  };
  refused("few points", score.trunks.too_few_points);
  refused("no fit", score.trunks.no_fit);
  refused("size", score.trunks.wrong_radius);
  refused("leaning", score.trunks.leaning);
  refused("not round", score.trunks.not_round);
  refused("uncertain", score.trunks.uncertain);
  refused("not upright", score.trunks.not_standing);
  refused("in leaves", score.trunks.in_leaves);

  rows.state("stems that had to be found from some station", ever(score.should_of_stem), "");
  rows.state("of them found from some station", ever(score.found_of_stem), "");
}

}  // namespace

void add_forest_plot_rows(const FrontendOptions& options, const std::atomic<bool>& stop,
                          FrontendRows& rows, nlohmann::json& traces) {
  const std::filesystem::path folder = options.data / "forest_3d_scans";
  if (!std::filesystem::is_directory(folder)) {
    fmt::print(stderr, "eval frontend: no {}: nothing to say of real forest plots\n",
               folder.string());
    return;
  }

  std::vector<ForestPlot> plots;
  for (const char* name : kPlots) plots.push_back(read_forest_plot(folder, name));

  constexpr std::size_t kBeams = std::size(kPlotLidars);
  std::vector<PlotScore> scores(plots.size() * kBeams);
  tools::run_in_parallel(scores.size(), options.jobs, "plots", stop, [&](std::size_t i) {
    PlotScoreOptions score;
    score.scanner.elevations_rad = sim::beam_elevations_rad(kPlotLidars[i % kBeams].model);
    score.seed = options.seed;
    scores[i] = score_plot(plots[i / kBeams], {}, score);
  });

  for (std::size_t i = 0; i < scores.size(); ++i) {
    const ForestPlot& plot = plots[i / kBeams];
    const PlotLidar& lidar = kPlotLidars[i % kBeams];
    rows.in(fmt::format("landmark_extractor, real plot {}: {} ({} stations, {:.0f} points)",
                        plot.name, lidar.name, scores[i].stations_m.size(), scores[i].points));
    add_rows(scores[i], rows);
    if (lidar.model == sim::LidarModel::kVlp32) traces[plot.name] = trace_of(plot, scores[i]);
  }
}

}  // namespace understory::eval::experiments::frontend
