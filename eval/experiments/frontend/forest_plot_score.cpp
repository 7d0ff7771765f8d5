#include "eval/experiments/frontend/forest_plot_score.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace understory::eval::experiments::frontend {
namespace {

constexpr double kVehicleHeight = 2.2;  // [m]
constexpr double kShrub = 1.0;          // [m] a vehicle drives over what is lower

/// One station: its detections take the nearest stems that are free.
void score_sweep(const ForestPlot& plot, const PlotSweep& sweep, const model::LandmarkScan& scan,
                 const Eigen::Vector2d& station_m, const PlotScoreOptions& options,
                 PlotScore& score) {
  std::vector<bool> is_taken(plot.stems.size(), false);
  for (const model::Detection& detection : scan.detections) {
    if (detection.kind == model::LandmarkKind::kCorner) {
      ++score.corners;
      continue;
    }

    PlotDetection one;
    one.position_m = detection.position_m.head<2>() + station_m;
    one.covariance_m2 = detection.covariance_m2.topLeftCorner<2, 2>();
    one.radius_m = detection.radius_m;

    double nearest_m = options.match_m;
    for (std::size_t i = 0; i < plot.stems.size(); ++i) {
      const double distance = (plot.stems[i].position_m - one.position_m).norm();
      if (is_taken[i] || distance >= nearest_m) continue;
      nearest_m = distance;
      one.stem = static_cast<int>(i);
    }

    if (one.stem >= 0) {
      is_taken[static_cast<std::size_t>(one.stem)] = true;
      one.is_whole = sweep.stems[static_cast<std::size_t>(one.stem)].is_whole;
    }
    score.detections.push_back(one);
  }

  // The station should find the stems that it sees well enough.
  for (std::size_t i = 0; i < plot.stems.size(); ++i) {
    const PlotStem& stem = plot.stems[i];
    if ((stem.position_m - station_m).norm() > options.recall_range_m) continue;

    const StemObservation& sight = sweep.stems[i];
    if (sight.returns < options.least_returns ||
        sight.returns < options.least_share * static_cast<double>(sight.beams)) {
      continue;
    }

    ++score.should;
    ++score.should_of_stem[i];

    if (!is_taken[i]) continue;
    ++score.found;
    ++score.found_of_stem[i];
  }
}

/// Of the detections that `counts`.
template <class Counts>
PlotErrors errors_of(const ForestPlot& plot, const PlotScore& score, Counts counts) {
  std::vector<Eigen::Vector2d> means(plot.stems.size(), Eigen::Vector2d::Zero());
  std::vector<double> numbers(plot.stems.size(), 0.0);

  // Differences to the list, and the mean of each stem's detections.
  PlotErrors errors;
  double square_m2 = 0.0;
  for (const PlotDetection& one : score.detections) {
    if (one.stem < 0 || !counts(one)) continue;
    const auto i = static_cast<std::size_t>(one.stem);
    square_m2 += (one.position_m - plot.stems[i].position_m).squaredNorm();
    errors.radius_bias_m += one.radius_m - plot.stems[i].radius_m;
    means[i] += (one.position_m - means[i]) / ++numbers[i];
    ++errors.detections;
  }

  if (errors.detections == 0) return errors;

  // Spread of the detections about their stem's mean.
  double spread_m2 = 0.0;
  double freedom = 0.0;
  for (const PlotDetection& one : score.detections) {
    if (one.stem < 0 || !counts(one)) continue;
    const auto i = static_cast<std::size_t>(one.stem);
    const Eigen::Vector2d off = one.position_m - means[i];
    spread_m2 += off.squaredNorm();
    errors.nees += off.dot(one.covariance_m2.inverse() * off);
    freedom += 1.0 - 1.0 / numbers[i];  // the mean is of the same detections
  }

  const auto number = static_cast<double>(errors.detections);
  errors.difference_m = std::sqrt(square_m2 / number);
  errors.radius_bias_m /= number;
  errors.spread_m = std::sqrt(spread_m2 / number);
  if (freedom > 0.0) errors.nees /= freedom;
  return errors;
}

}  // namespace

double PlotScore::precision() const {
  if (detections.empty()) return 1.0;
  const auto right = std::count_if(detections.begin(), detections.end(),
                                   [](const PlotDetection& one) { return one.stem >= 0; });
  return static_cast<double>(right) / static_cast<double>(detections.size());
}

std::vector<Eigen::Vector2d> plot_stations(const ForestPlot& plot,
                                           const PlotScoreOptions& options) {
  if (plot.stems.empty()) return {};
  Eigen::Vector2d low = plot.stems.front().position_m;
  Eigen::Vector2d high = low;
  for (const PlotStem& stem : plot.stems) {
    low = low.cwiseMin(stem.position_m);
    high = high.cwiseMax(stem.position_m);
  }
  std::vector<Eigen::Vector2d> stations;
  for (double x = low.x() + 0.5 * options.grid_m; x < high.x(); x += options.grid_m) {
    for (double y = low.y() + 0.5 * options.grid_m; y < high.y(); y += options.grid_m) {
      const Eigen::Vector2d place(x, y);
      const bool is_free = std::ranges::none_of(plot.points, [&](const PlotPoint& point) {
        return point.height_m > kShrub && point.height_m < kVehicleHeight &&
               (point.position_m.head<2>() - place).norm() < options.clearance_m;
      });
      if (is_free) stations.push_back(place);
    }
  }
  return stations;
}

PlotScore score_plot(const ForestPlot& plot,
                     const landmark_extractor::LandmarkExtractorParameters& parameters,
                     const PlotScoreOptions& options) {
  PlotScore score;
  score.stations_m = plot_stations(plot, options);
  score.should_of_stem.assign(plot.stems.size(), 0);
  score.found_of_stem.assign(plot.stems.size(), 0);
  const PlotScanner scanner(plot, options.scanner);
  landmark_extractor::LandmarkExtractor extractor(parameters);
  std::mt19937_64 random(options.seed);
  for (const Eigen::Vector2d& station : score.stations_m) {
    const PlotSweep sweep = scanner.sweep(station, random);
    score.points += static_cast<double>(sweep.sweep.points.size());
    score_sweep(plot, sweep, extractor.extract(sweep.sweep), station, options, score);
  }
  score.trunks = extractor.sweep_counters().trunks;
  score.points /= std::max<double>(1.0, static_cast<double>(score.stations_m.size()));
  score.all = errors_of(plot, score, [](const PlotDetection&) { return true; });
  score.whole = errors_of(plot, score, [](const PlotDetection& one) { return one.is_whole; });
  return score;
}

}  // namespace understory::eval::experiments::frontend
